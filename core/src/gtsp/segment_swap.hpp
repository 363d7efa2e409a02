// Or-3opt: two neighbouring segments of a tour change places; and 2-opt where costs are symmetric.
#pragma once

#include <span>
#include <vector>

#include "pushplan/array.hpp"

namespace pushplan::gtsp {

class SegmentSwaps {
 public:
  /// Swaps neighbouring segments of a closed tour of clusters, and reverses one where costs are
  /// symmetric, until nothing gains more than the tolerance. Returns the gain.
  double improve(ArrayView<const double, 2> costs,
                 ArrayView<const Index, 2> near,  // (m, k) clusters by distance
                 Index reach,                     // of these, so many are tried
                 std::span<Index> order, std::span<Index> nodes, bool symmetric, double tolerance);

 private:
  double first_swap(Index i);
  double first_reversal(Index i);
  void swap(Index i, Index j, Index k);
  void rotate(std::span<Index> values, Index low, Index middle, Index high);
  void reverse(Index low, Index high);

  Index next(Index i) const { return i + 1 < count() ? i + 1 : 0; }
  Index previous(Index i) const { return i > 0 ? i - 1 : count() - 1; }
  Index count() const { return static_cast<Index>(order_.size()); }
  Index node(Index place) const { return nodes_[static_cast<std::size_t>(place)]; }
  /// Where the neighbour of this number of the cluster at a place stands.
  Index neighbour(Index place, Index number) const;

  ArrayView<const double, 2> costs_;
  ArrayView<const Index, 2> near_;
  Index reach_ = 0;
  double tolerance_ = 0.0;
  std::span<Index> order_;
  std::span<Index> nodes_;
  std::vector<Index> place_;  // (m,) where each cluster stands
  std::vector<Index> scratch_;
};

}  // namespace pushplan::gtsp
