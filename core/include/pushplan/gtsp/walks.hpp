// Lower bounds by relaxed tours, and the few paths that they leave.
//
// A walk of m arcs from the root to the root may come to a cluster twice, but not while it
// remembers it: at each cluster d it knows those on the short list `lists[d]` (the ng-route
// relaxation of Baldacci, Mingozzi and Roberti 2011). A memory M is a bit mask over that list.
// Everything is numbered without the root: n clusters of at most K nodes, padded with infinite
// costs, b clusters on a list.
#pragma once

#include <span>

#include "pushplan/array.hpp"

namespace pushplan::gtsp {

/// Clusters that walks come to.
struct WalkClusters {
  std::span<const double> prices;   // (n,) what a visit of each earns
  std::span<const Index> sizes;     // (n,) nodes of each
  ArrayView<const Index, 3> moves;  // (n, n, 2^b) the new memory with cluster d before a walk from
                                    // e, -1 where that walk remembers d
};

/// Puts a node of clusters `low` to `high - 1` in front of every walk to the root.
void extend_walks(ArrayView<const double, 3> walks,   // (n, 2^b, K) cheapest walks of k arcs
                  ArrayView<double, 3> longer,        // (n, 2^b, K) filled with those of k + 1
                  ArrayView<const double, 4> blocks,  // (n, K, n, K) to a node, from a node
                  const WalkClusters& clusters, Index low, Index high);

/// Finds how often the cheapest walk from the root through n nodes and back comes to each cluster.
/// Returns its cost less prices, infinite if there is none.
double read_visits(ArrayView<const double, 4> walks,   // (n, n, 2^b, K) by number of arcs less 1
                   ArrayView<const double, 2> first,   // (n, K) from the root to each node
                   ArrayView<const double, 4> blocks,  // (n, K, n, K)
                   const WalkClusters& clusters,
                   std::span<Index> visits);  // (n,) filled

/// Partial tours of one length, from the root; structure of arrays.
template <class Number, class Integer>
struct PathArrays {
  std::span<Integer> sets;     // clusters of each as a bit mask
  std::span<Integer> ends;     // its last node, `d * K + i`
  std::span<Number> values;    // its cost
  std::span<Number> rests;     // sum of the prices of the clusters that it lacks
  std::span<Integer> parents;  // the path that it comes from
};
using Paths = PathArrays<double, Index>;
using ConstPaths = PathArrays<const double, const Index>;

/// What decides whether a path is worth keeping.
struct PathBounds {
  ArrayView<const double, 3> within;  // (n, 2^b, K) walks to the root; of a memory, the least of
                                      // those of memories within it
  ArrayView<const double, 4> costs;   // (n, K, n, K) from a node to a node
  ArrayView<const Index, 2> lists;    // (n, b)
  std::span<const double> prices;     // (n,)
  std::span<const Index> sizes;       // (n,)
  double limit;                       // paths that cannot stay below it are dropped
};

/// Adds one node to the paths `low` to `high - 1`, and keeps the cheapest for each set and end.
/// Returns how many longer paths there are then, -1 if there is no room for them.
Index extend_paths(const PathBounds& bounds, const ConstPaths& paths, Index low, Index high,
                   std::span<Index> slots,  // hash table, a power of two in size, -1 where empty
                   const Paths& longer,     // filled
                   Index found);            // longer paths so far

}  // namespace pushplan::gtsp
