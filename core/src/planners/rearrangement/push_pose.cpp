#include "pushplan/planners/rearrangement/push_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/planners/rearrangement/pose_grid.hpp"

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

}  // namespace pushplan::rearrangement
