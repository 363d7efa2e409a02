#include "pushplan/planners/rearrangement/push_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "pushplan/planners/rearrangement/pose_grid.hpp"
#include "pushplan/search/heap.hpp"

namespace pushplan::rearrangement {

Pose pose_behind(const Pose& object, Polygon outline, double heading, double shift,
                 double distance) {
  const double c = std::cos(heading);
  const double s = std::sin(heading);
  const double cos = std::cos(object.theta);
  const double sin = std::sin(object.theta);
  double depth = -std::numeric_limits<double>::infinity();
  for (const Vec2 p : outline) {
    depth = std::max(depth, -((cos * p.x - sin * p.y) * c + (sin * p.x + cos * p.y) * s));
  }
  depth += distance;
  return {object.x - depth * c - shift * s, object.y - depth * s + shift * c, heading};
}

void pushable_moves(ArrayView<const Vec2, 2> middles, ArrayView<const bool, 2> is_open,
                    std::span<const double> shifts, double distance, CollisionChecker& checker,
                    ArrayView<bool, 3> out) {
  for (std::size_t t = 0; t < kHeadingCount; ++t) {
    const double c = std::cos(kHeadings[t]);
    const double s = std::sin(kHeadings[t]);
    for (Index i = 0; i < is_open.extent(0); ++i) {
      for (Index j = 0; j < is_open.extent(1); ++j) {
        if (!is_open(i, j)) continue;
        const Vec2 middle = middles(i, j);
        out(t, i, j) = std::ranges::any_of(shifts, [&](double shift) {
          return checker.is_free({middle.x - distance * c - shift * s,
                                  middle.y - distance * s + shift * c, kHeadings[t]});
        });
      }
    }
  }
}

void fill_push_costs(ArrayView<const bool, 2> is_open, ArrayView<const bool, 3> pushable,
                     std::span<const Index> goals, double step, double drag_cost,
                     ArrayView<double, 2> costs) {
  const Index rows = is_open.extent(0);
  const Index cols = is_open.extent(1);
  std::fill_n(costs.data(), costs.size(), std::numeric_limits<double>::infinity());
  std::vector<Index> places(static_cast<std::size_t>(costs.size()), NodeHeap::kNowhere);
  const auto place = [&](Index node) -> Index& { return places[static_cast<std::size_t>(node)]; };
  NodeHeap heap(costs.size());
  for (const Index goal : goals) {
    costs.data()[goal] = 0.0;
    heap.push_or_change(goal, 0.0, place);
  }
  while (!heap.empty()) {  // from the goals on, against the moves
    const Index to = heap.pop(place);
    for (std::size_t t = 0; t < kHeadingCount; ++t) {
      const Index i = to / cols - kMoves[t].y;
      const Index j = to % cols - kMoves[t].x;
      if (i < 0 || j < 0 || i >= rows || j >= cols || !is_open(i, j)) continue;
      const double length = kLengths[t] * step;
      const double cost = costs.data()[to] + (pushable(t, i, j) ? length : drag_cost * length);
      if (cost < costs(i, j)) {
        costs(i, j) = cost;
        heap.push_or_change(i * cols + j, cost, place);
      }
    }
  }
}

}  // namespace pushplan::rearrangement
