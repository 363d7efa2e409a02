#include "pushplan/search/grid_dijkstra.hpp"

#include <cmath>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
GridDijkstra::GridDijkstra(ArrayView<const double, 2> weights, double cell,
                           std::span<const Index> starts)
    : weights_(weights),
      cell_(cell),
      costs_(at(weights.size()), kInfinity),
      parents_(at(weights.size()), -1),
      places_(at(weights.size()), NodeHeap::kNowhere),
      heap_(weights.size()) {
  order_.reserve(at(weights.size()));
  for (const Index start : starts) {
    costs_[at(start)] = 0.0;
    heap_.push_or_change(start, 0.0, [&](Index node) -> Index& { return places_[at(node)]; });
  }
}

bool GridDijkstra::settle(ArrayView<const bool, 2> goals, Index upto) {
  const Index rows = weights_.extent(0);
  const Index cols = weights_.extent(1);
  const auto place = [&](Index node) -> Index& { return places_[at(node)]; };
  const double diagonal = cell_ * std::sqrt(2.0);
  while (!heap_.empty() && static_cast<Index>(order_.size()) < upto) {
    const Index here = heap_.pop(place);
    const Index r = here / cols;
    const Index c = here % cols;
    order_.push_back(here);
    if (goals(r, c)) return false;
    const double cost_here = costs_[at(here)];
    for (Index dr = -1; dr <= 1; ++dr) {
      for (Index dc = -1; dc <= 1; ++dc) {
        if (dr == 0 && dc == 0) continue;
        const Index to_r = r + dr;
        const Index to_c = c + dc;
        if (to_r < 0 || to_c < 0 || to_r >= rows || to_c >= cols) continue;
        const double weight = weights_(to_r, to_c);
        if (std::isinf(weight)) continue;
        const double cost = cost_here + (dr == 0 || dc == 0 ? cell_ : diagonal) * weight;
        const Index to = to_r * cols + to_c;
        if (cost < costs_[at(to)]) {
          costs_[at(to)] = cost;
          parents_[at(to)] = here;
          heap_.push_or_change(to, cost, place);
        }
      }
    }
  }
  return !heap_.empty();
}

}  // namespace pushplan
