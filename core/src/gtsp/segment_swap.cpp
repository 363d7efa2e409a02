#include "segment_swap.hpp"

#include <algorithm>
#include <utility>

#include "layers.hpp"

namespace pushplan::gtsp {

double SegmentSwaps::improve(ArrayView<const double, 2> costs, ArrayView<const Index, 2> near,
                             Index reach, std::span<Index> order, std::span<Index> nodes,
                             bool symmetric, double tolerance) {
  // a move takes out the arcs after places i, j and k and links a cluster to one of its neighbours,
  // which must be cheaper than the arc that is taken out
  costs_ = costs;
  near_ = near;
  reach_ = reach;
  tolerance_ = tolerance;
  order_ = order;
  nodes_ = nodes;
  place_.resize(order.size());
  scratch_.resize(order.size());
  for (Index p = 0; p < count(); ++p) place_[at(order_[at(p)])] = p;
  double total = 0.0;
  Index tries = 0;
  Index i = 0;
  while (tries < count()) {
    double gain = first_swap(i);
    if (gain == 0.0 && symmetric) gain = first_reversal(i);
    if (gain > 0.0) {
      total += gain;
      tries = 0;
    } else {
      ++tries;
      i = next(i);
    }
  }
  return total;
}

Index SegmentSwaps::neighbour(Index place, Index number) const {
  return place_[at(near_(order_[at(place)], number))];
}

/// Makes the first swap after place i that pays. Returns its gain, 0 if there is none.
double SegmentSwaps::first_swap(Index i) {
  const Index i1 = next(i);
  const Index a = node(i);
  const Index a1 = node(i1);
  for (Index first = 0; first < reach_; ++first) {
    const Index j1 = neighbour(i, first);
    if (j1 == i1) continue;
    double gain1 = costs_(a, a1) - costs_(a, node(j1));
    if (gain1 <= tolerance_) continue;
    const Index j = previous(j1);
    const Index b = node(j);
    const Index b1 = node(j1);
    gain1 += costs_(b, b1);
    for (Index second = 0; second < reach_; ++second) {
      // k lies from j1 on, before i comes round again
      const Index k1 = neighbour(j, second);
      const Index k = previous(k1);
      const Index ahead_k = k >= j1 ? k - j1 : k - j1 + count();
      const Index ahead_i = i >= j1 ? i - j1 : i - j1 + count();
      if (k1 == j1 || ahead_k > ahead_i || k == i) continue;
      const Index c = node(k);
      const Index c1 = node(k1);
      const double gain = gain1 + costs_(c, c1) - costs_(b, c1) - costs_(c, a1);
      if (gain > tolerance_) {
        swap(i, j, k);
        return gain;
      }
    }
  }
  return 0.0;
}

/// Exchanges the segments after i and after j up to k of the closed tour.
void SegmentSwaps::swap(Index i, Index j, Index k) {
  // sort the three cuts: exchanging two of three segments of a circle is the same for all
  const Index low = std::min({i, j, k});
  const Index high = std::max({i, j, k});
  const Index middle = i + j + k - low - high;
  rotate(order_, low + 1, middle + 1, high + 1);
  rotate(nodes_, low + 1, middle + 1, high + 1);
  for (Index p = low + 1; p < std::min(high + 1, count()); ++p) place_[at(order_[at(p)])] = p;
}

void SegmentSwaps::rotate(std::span<Index> values, Index low, Index middle, Index high) {
  std::copy(values.begin() + low, values.begin() + middle, scratch_.begin());
  std::copy(values.begin() + middle, values.begin() + high, values.begin() + low);
  std::copy_n(scratch_.begin(), middle - low, values.begin() + low + (high - middle));
}

/// 2-opt (Croes 1958): new arcs from place i to j and from i + 1 to j + 1, or one before.
double SegmentSwaps::first_reversal(Index i) {
  for (const bool forward : {true, false}) {
    const Index other = forward ? next(i) : previous(i);
    const Index a = node(i);
    const Index a1 = node(other);
    for (Index first = 0; first < reach_; ++first) {
      const Index j = neighbour(i, first);
      double gain = costs_(a, a1) - costs_(a, node(j));
      if (gain <= tolerance_ || j == other) continue;
      const Index partner = forward ? next(j) : previous(j);
      if (partner == i) continue;
      gain += costs_(node(j), node(partner)) - costs_(a1, node(partner));
      if (gain > tolerance_) {
        if (forward) {
          reverse(std::min(i, j) + 1, std::max(i, j));
        } else {
          reverse(std::min(i, j), std::max(i, j) - 1);
        }
        return gain;
      }
    }
  }
  return 0.0;
}

/// Turns the segment from `low` to `high`, both included, around.
void SegmentSwaps::reverse(Index low, Index high) {
  const Index first = low;
  const Index last = high;
  for (; low < high; ++low, --high) {
    std::swap(order_[at(low)], order_[at(high)]);
    std::swap(nodes_[at(low)], nodes_[at(high)]);
  }
  for (Index p = first; p <= last; ++p) place_[at(order_[at(p)])] = p;
}

}  // namespace pushplan::gtsp
