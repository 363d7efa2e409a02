// Optimal tours by dynamic programming over sets of clusters.
#pragma once

#include <span>

#include "pushplan/array.hpp"

namespace pushplan::gtsp {

/// Fills the sets `low` to `high - 1` of a table (Held and Karp 1962, with clusters in place of
/// cities). `table(S, c, j)` is the cost of the cheapest path from the root through one node of
/// every cluster in S, a bit mask, that ends in node j of cluster c. m clusters of at most K nodes,
/// without the root's; what is padded costs infinitely much.
void fill_subsets(Index low,  // at least 1; all sets before it are filled
                  Index high, ArrayView<double, 3> table,  // (2^m, m, K)
                  ArrayView<const double, 4> blocks,       // (m, K, m, K) from a node to a node
                  std::span<const Index> sizes,            // (m,) nodes of each cluster
                  ArrayView<const double, 2> first);       // (m, K) from the root to each node

}  // namespace pushplan::gtsp
