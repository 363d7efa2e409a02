// Shortest paths through the layers of a tour, kept up to date while clusters come and go.
//
// `ahead(c, v)` is the cost of the cheapest path from the root's node along the tour to node v of
// cluster c, `behind(c, v)` of that from there to the root. A change moves all values past it by
// what the tour costs more. That amount is carried by the cluster beside the change instead (both
// its values are lowered by `carry[c]`), so that only a few values have to be renewed, up to where
// they agree with the old ones; and in every gap of the tour the cheapest path across costs 0.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "pushplan/arithmetic.hpp"
#include "pushplan/array.hpp"
#include "pushplan/gtsp/problem.hpp"

namespace pushplan::gtsp {

/// Fills `out[w]` with the least of `values[v] + costs(from + v, to + w)` over v, for w below
/// `n_to`, four columns at a time. Up to `kSpare` numbers past `n_to` are written too and mean
/// nothing.
inline void push_values(const ArrayView<const double, 2>& costs, const double* values, Index from,
                        Index n_from, Index to, Index n_to, double* out) {
  const Index stride = costs.extent(1);
  for (Index w = 0; w < n_to; w += 4) {
    double first = kInfinity;
    double second = kInfinity;
    double third = kInfinity;
    double fourth = kInfinity;
    const double* cost = costs.data() + from * stride + to + w;
    for (Index v = 0; v < n_from; ++v, cost += stride) {
      const double x = values[v];
      first = std::min(first, x + cost[0]);
      second = std::min(second, x + cost[1]);
      third = std::min(third, x + cost[2]);
      fourth = std::min(fourth, x + cost[3]);
    }
    out[w] = first;
    out[w + 1] = second;
    out[w + 2] = third;
    out[w + 3] = fourth;
  }
}

/// The same from the transpose, row by row: quicker where few nodes are reached from many.
inline void pull_values(const ArrayView<const double, 2>& reverse, const double* values, Index from,
                        Index n_from, Index to, Index n_to, double* out) {
  const Index stride = reverse.extent(1);
  const Index whole = n_from - n_from % 4;
  for (Index w = 0; w < n_to; ++w) {
    double first = kInfinity;
    double second = kInfinity;
    double third = kInfinity;
    double fourth = kInfinity;
    const double* cost = reverse.data() + (to + w) * stride + from;
    for (Index v = 0; v < whole; v += 4) {
      first = std::min(first, values[v] + cost[v]);
      second = std::min(second, values[v + 1] + cost[v + 1]);
      third = std::min(third, values[v + 2] + cost[v + 2]);
      fourth = std::min(fourth, values[v + 3] + cost[v + 3]);
    }
    for (Index v = whole; v < n_from; ++v) first = std::min(first, values[v] + cost[v]);
    out[w] = std::min(std::min(first, second), std::min(third, fourth));
  }
}

class Layers {
 public:
  Layers(const Problem& problem, Index root)
      : problem_(problem), root_(root), width_(problem.width()) {
    const std::size_t count = at(problem.clusters());
    const std::size_t wide = at(width_ + kSpare);
    clusters_.resize(count);
    for (Index c = 0; c < problem.clusters(); ++c) {
      clusters_[at(c)].first = problem.first(c);
      clusters_[at(c)].size = c == root ? 1 : problem.size(c);
    }
    saved_.resize(count);
    ahead_.resize(count * at(width_));
    behind_.resize(ahead_.size());
    saved_ahead_.resize(ahead_.size());
    saved_behind_.resize(ahead_.size());
    out_.resize(wide);
    left_.resize(wide);
    right_.resize(wide);
    touched_.reserve(count);
  }

  Index root() const { return root_; }
  Index after(Index c) const { return clusters_[at(c)].after; }
  Index before(Index c) const { return clusters_[at(c)].before; }
  double carry(Index c) const { return clusters_[at(c)].carry; }

  /// Computes all values of a closed tour from scratch. Returns its cost.
  double build(std::span<const Index> order, Index root_node) {
    const std::size_t count = order.size();
    clusters_[at(root_)].first = root_node;
    for (std::size_t p = 0; p < count; ++p) {
      const Index c = order[p];
      const Index d = order[p + 1 < count ? p + 1 : 0];
      clusters_[at(c)].carry = 0.0;
      clusters_[at(c)].after = d;
      clusters_[at(d)].before = c;
    }
    ahead(root_)[0] = 0.0;
    for (std::size_t p = 1; p < count; ++p) {
      spread(true, order[p - 1], order[p], out_.data());
      std::copy_n(out_.data(), size(order[p]), ahead(order[p]));
    }
    spread(true, order[count - 1], root_, out_.data());
    const double total = out_[0];
    behind(root_)[0] = -total;
    clusters_[at(root_)].least_ahead = 0.0;
    clusters_[at(root_)].least_behind = -total;
    for (std::size_t p = count - 1; p > 0; --p) {
      const Index c = order[p];
      spread(false, after(c), c, out_.data());
      std::copy_n(out_.data(), size(c), behind(c));
      note_least(c);
    }
    return total;
  }

  /// Begins a round, which `undo` can take back.
  void begin_round() {
    ++round_;
    touched_.clear();
  }

  /// Saves a cluster as it is, once in a round.
  void keep(Index c) {
    Saved& saved = saved_[at(c)];
    if (saved.round == round_) return;
    saved.round = round_;
    saved.cluster = clusters_[at(c)];
    touched_.push_back(c);
    std::copy_n(ahead(c), size(c), saved_ahead_.data() + c * width_);
    std::copy_n(behind(c), size(c), saved_behind_.data() + c * width_);
  }

  void undo() {
    for (const Index c : touched_) {
      clusters_[at(c)] = saved_[at(c)].cluster;
      std::copy_n(saved_ahead_.data() + c * width_, size(c), ahead(c));
      std::copy_n(saved_behind_.data() + c * width_, size(c), behind(c));
    }
  }

  /// Links cluster a to b, what was between them being gone. Returns the change of cost.
  double close_gap(Index a, Index b,
                   double carried,      // sum of `carry` of the clusters that were between them
                   double tolerance) {  // of values that count as equal
    keep(a);
    keep(b);
    clusters_[at(a)].after = b;
    clusters_[at(b)].before = a;
    double* out = out_.data();
    spread(true, a, b, out);
    double cost = kInfinity;
    for (Index v = 0; v < size(b); ++v) cost = std::min(cost, out[v] + behind(b)[v]);
    if (a != root_) {
      clusters_[at(a)].carry += cost;
      spread(false, b, a, out);
      for (Index v = 0; v < size(a); ++v) {
        ahead(a)[v] -= cost;
        behind(a)[v] = out[v] - carry(a);
      }
      renew_both(a, tolerance);
    } else {
      clusters_[at(b)].carry += cost;
      for (Index v = 0; v < size(b); ++v) {
        ahead(b)[v] = out[v] - carry(b);
        behind(b)[v] -= cost;
      }
      renew_both(b, tolerance);
    }
    return cost - carried;
  }

  /// The increase in the tour's cost with cluster c between a and b, infinite where a lower bound
  /// says that it is not below the limit.
  double insertion_cost(Index c, Index a, Index b, double limit) {
    const Index first = clusters_[at(c)].first;
    const Index n = size(c);
    const double start = clusters_[at(a)].least_ahead;
    const double end = clusters_[at(b)].least_behind;
    const double* into = problem_.into.row(a).data() + first;
    const double* onto = problem_.onto.row(b).data() + first;
    double bound = kInfinity;
    for (Index v = 0; v < n; ++v) bound = std::min(bound, into[v] + onto[v]);
    if (start + bound + end >= limit) return kInfinity;
    double* left = left_.data();
    double* right = right_.data();
    spread(true, a, c, left);
    bound = kInfinity;
    for (Index v = 0; v < n; ++v) bound = std::min(bound, left[v] + onto[v]);
    if (bound + end >= limit) return kInfinity;
    spread(false, b, c, right);
    double cost = kInfinity;
    for (Index v = 0; v < n; ++v) cost = std::min(cost, left[v] + right[v]);
    return cost;
  }

  /// Puts cluster c behind cluster a. Returns the change of the tour's cost.
  double link_in(Index c, Index a, double tolerance) {
    const Index b = after(a);
    const double cost = insertion_cost(c, a, b, kInfinity);
    keep(a);
    keep(b);
    clusters_[at(a)].after = c;
    clusters_[at(c)].before = a;
    clusters_[at(c)].after = b;
    clusters_[at(b)].before = c;
    clusters_[at(c)].carry = cost;
    for (Index v = 0; v < size(c); ++v) {
      ahead(c)[v] = left_[at(v)] - cost;
      behind(c)[v] = right_[at(v)] - cost;
    }
    renew_both(c, tolerance);
    return cost;
  }

  /// Takes down what the tour would cost more by way of each node: the least so far, and the sum.
  void note_slack(std::span<double> least, std::span<double> total) const {
    for (Index c = 0; c < problem_.clusters(); ++c) {
      for (Index v = 0; v < size(c); ++v) {
        const std::size_t node = at(clusters_[at(c)].first + v);
        const double extra = ahead_[at(c * width_ + v)] + behind_[at(c * width_ + v)];
        least[node] = std::min(least[node], extra);
        total[node] += extra;
      }
    }
  }

 private:
  struct Cluster {
    Index first = 0;  // its first node; of the root, the node that counts
    Index size = 0;   // its nodes; 1 for the root
    Index after = 0;  // the next cluster of the tour
    Index before = 0;
    double carry = 0.0;
    double least_ahead = 0.0;  // the least of its values
    double least_behind = 0.0;
  };
  struct Saved {
    Index round = -1;
    Cluster cluster;
  };

  static constexpr Index kNarrow = 3;  // smaller clusters are entered along rows of the transpose

  Index size(Index c) const { return clusters_[at(c)].size; }
  double* ahead(Index c) { return ahead_.data() + c * width_; }
  double* behind(Index c) { return behind_.data() + c * width_; }

  void note_least(Index c) {
    double least_ahead = kInfinity;
    double least_behind = kInfinity;
    for (Index v = 0; v < size(c); ++v) {
      least_ahead = std::min(least_ahead, ahead(c)[v]);
      least_behind = std::min(least_behind, behind(c)[v]);
    }
    clusters_[at(c)].least_ahead = least_ahead;
    clusters_[at(c)].least_behind = least_behind;
  }

  /// Fills `out` with the values of cluster b from those of cluster a, one way or the other.
  void spread(bool forward, Index a, Index b, double* out) {
    const double* values = forward ? ahead(a) : behind(a);
    const Index from = clusters_[at(a)].first;
    const Index to = clusters_[at(b)].first;
    const Index n_from = size(a);
    const Index n_to = size(b);
    if (n_to < kNarrow && n_from > n_to) {
      const auto& rows = forward ? problem_.reverse : problem_.costs;
      pull_values(rows, values, from, n_from, to, n_to, out);
    } else {
      const auto& rows = forward ? problem_.costs : problem_.reverse;
      push_values(rows, values, from, n_from, to, n_to, out);
    }
  }

  /// Renews the values past cluster c in one direction, up to where they are as they were.
  void renew(bool forward, Index c, double tolerance) {
    double* out = out_.data();
    Index previous = c;
    c = forward ? after(c) : before(c);
    while (c != root_) {
      spread(forward, previous, c, out);
      double* values = forward ? ahead(c) : behind(c);
      bool changed = false;
      double least = kInfinity;
      for (Index v = 0; v < size(c); ++v) {
        out[v] -= carry(c);
        least = std::min(least, out[v]);
        changed = changed || std::abs(out[v] - values[v]) > tolerance;
      }
      if (!changed) return;
      keep(c);
      (forward ? clusters_[at(c)].least_ahead : clusters_[at(c)].least_behind) = least;
      std::copy_n(out, size(c), values);
      previous = c;
      c = forward ? after(c) : before(c);
    }
  }

  /// Renews the values on both sides of cluster c, which have changed too.
  void renew_both(Index c, double tolerance) {
    note_least(c);
    renew(true, c, tolerance);
    renew(false, c, tolerance);
  }

  const Problem& problem_;
  Index root_;
  Index width_;
  Index round_ = 0;
  std::vector<Cluster> clusters_;
  std::vector<double> ahead_;  // (m, K), as the next three
  std::vector<double> behind_;
  std::vector<double> saved_ahead_;
  std::vector<double> saved_behind_;
  std::vector<Saved> saved_;
  std::vector<Index> touched_;  // clusters saved in this round
  std::vector<double> out_;     // (K + kSpare,) working memory, as the next two
  std::vector<double> left_;
  std::vector<double> right_;
};

}  // namespace pushplan::gtsp
