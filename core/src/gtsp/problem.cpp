#include "pushplan/gtsp/problem.hpp"

#include <algorithm>

#include "layers.hpp"

namespace pushplan::gtsp {
namespace {

constexpr Index kEffort = 16;  // comparisons for each pair of nodes, after which the search ends

/// The first node outside the cluster `low` to `high - 1` to which u costs more than v; N if none.
Index agrees_until(const ArrayView<const double, 2>& costs, Index u, Index v, Index low,
                   Index high) {
  const auto of_u = costs.row(u);
  const auto of_v = costs.row(v);
  const Index count = costs.extent(0);
  for (Index w = 0; w < low; ++w) {
    if (of_u[at(w)] > of_v[at(w)]) return w;
  }
  for (Index w = high; w < count; ++w) {
    if (of_u[at(w)] > of_v[at(w)]) return w;
  }
  return count;
}

}  // namespace

Index Problem::width() const {
  Index widest = 0;
  for (Index c = 0; c < clusters(); ++c) widest = std::max(widest, size(c));
  return widest;
}

void mark_needed(ArrayView<const double, 2> costs, ArrayView<const double, 2> reverse,
                 std::span<const Index> offsets, std::span<Index> needed) {
  const Index count = costs.extent(0);
  Index left = kEffort * count * count;
  for (std::size_t c = 0; c + 1 < offsets.size(); ++c) {
    const Index low = offsets[c];
    const Index high = offsets[c + 1];
    for (Index v = low; v < high; ++v) {
      for (Index u = low; u < high; ++u) {
        if (u == v || needed[at(u)] == 0) continue;
        Index same = agrees_until(costs, u, v, low, high);
        left -= same;
        if (same == count) {
          same = agrees_until(reverse, u, v, low, high);
          left -= same;
        }
        if (left < 0) return;
        if (same == count) {
          needed[at(v)] = 0;
          break;
        }
      }
    }
  }
}

double best_nodes(ArrayView<const double, 2> costs, std::span<const Index> offsets,
                  std::span<const Index> order, std::span<Index> nodes,
                  ArrayView<double, 2> layers) {
  const Index count = static_cast<Index>(order.size());
  const auto first_of = [&](Index place) { return offsets[at(order[at(place)])]; };
  const auto end_of = [&](Index place) { return offsets[at(order[at(place)] + 1)]; };
  double best = kInfinity;
  for (Index root = first_of(0); root < end_of(0); ++root) {
    Index from = first_of(1);
    Index n_from = end_of(1) - from;
    for (Index v = 0; v < n_from; ++v) layers(1, v) = costs(root, from + v);
    for (Index place = 2; place < count; ++place) {
      const Index to = first_of(place);
      const Index n_to = end_of(place) - to;
      push_values(costs, layers.row(place - 1).data(), from, n_from, to, n_to,
                  layers.row(place).data());
      from = to;
      n_from = n_to;
    }
    double cost = kInfinity;
    Index end = -1;
    for (Index v = first_of(count - 1); v < end_of(count - 1); ++v) {
      const double x = layers(count - 1, v - first_of(count - 1)) + costs(v, root);
      if (x < cost) {
        cost = x;
        end = v;
      }
    }
    if (!(cost < best)) continue;
    best = cost;
    nodes[0] = root;
    nodes[at(count - 1)] = end;
    for (Index place = count - 1; place > 1; --place) {
      // the first node of the layer before whose value leads here
      const Index to = nodes[at(place)];
      const Index before = first_of(place - 1);
      const double value = layers(place, to - first_of(place));
      Index pick = before;
      for (Index v = before; v < end_of(place - 1); ++v) {
        if (layers(place - 1, v - before) + costs(v, to) == value) {
          pick = v;
          break;
        }
      }
      nodes[at(place - 1)] = pick;
    }
  }
  return best;
}

}  // namespace pushplan::gtsp
