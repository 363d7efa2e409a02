// A generalized travelling salesman problem as the search wants it.
#pragma once

#include <span>

#include "pushplan/array.hpp"

namespace pushplan::gtsp {

/// Columns that the cost matrices of a search have past the last node: costs are read four at a
/// time, and what is past the last node is never used.
inline constexpr Index kSpare = 3;

/// Costs with the nodes ordered by clusters: cluster c has the nodes `offsets[c]` to
/// `offsets[c + 1] - 1`. N nodes in m clusters. All costs are finite.
struct Problem {
  ArrayView<const double, 2> costs;    // (N, N + kSpare) from a node to a node
  ArrayView<const double, 2> reverse;  // (N, N + kSpare) of the transpose
  ArrayView<const double, 2> into;     // (m, N) cheapest arc from a cluster to a node
  ArrayView<const double, 2> onto;     // (m, N) cheapest arc from a node to a cluster
  std::span<const Index> offsets;      // (m + 1,)
  ArrayView<const Index, 2> near;      // (m, k) other clusters by distance
  ArrayView<const double, 2> between;  // (m, k) these distances
  bool symmetric = false;              // every arc costs the same in both directions

  Index clusters() const { return static_cast<Index>(offsets.size()) - 1; }
  Index nodes() const { return costs.extent(0); }
  Index first(Index cluster) const { return offsets[static_cast<std::size_t>(cluster)]; }
  Index size(Index cluster) const { return first(cluster + 1) - first(cluster); }
  /// Nodes of the largest cluster.
  Index width() const;
};

/// Marks the nodes that a tour may need: 0 in `needed`, (N,) and full of ones before, for a node
/// whose arcs all cost as much as those of another node of its cluster, or more. Of nodes that cost
/// the same the last is kept. Ends after 16 N^2 comparisons; what is not looked at counts as
/// needed.
void mark_needed(ArrayView<const double, 2> costs,    // (N, N); infinite forbids an arc
                 ArrayView<const double, 2> reverse,  // (N, N) the transpose
                 std::span<const Index> offsets, std::span<Index> needed);

/// Finds the cheapest nodes for a closed order of at least two clusters (Fischetti, Salazar and
/// Toth 1997): a shortest path through the layers of nodes, for every node of `order[0]`, which
/// should be a small cluster. Returns the cost.
double best_nodes(ArrayView<const double, 2> costs,  // (N, N + kSpare)
                  std::span<const Index> offsets, std::span<const Index> order,
                  std::span<Index> nodes,        // as many as clusters in the order; filled
                  ArrayView<double, 2> layers);  // (m, K + kSpare) working memory

}  // namespace pushplan::gtsp
