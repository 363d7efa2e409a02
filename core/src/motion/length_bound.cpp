#include "pushplan/motion/length_bound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pushplan {
namespace {

constexpr int kDirections = 360;  // in which tangents to a disc are looked at

/// The bound for a line with a normal heading, so far away [m].
double turning_length(double heading, double away, const Pose& start, double radius) {
  if (away <= 0.0) return 0.0;
  const double turn = std::abs(wrap_angle(heading - start.theta));
  const double gained = radius * std::sin(turn);  // towards the line, by the time that it is faced
  if (away >= gained) return radius * turn + away - gained;
  return radius * (turn - std::asin(std::clamp(std::sin(turn) - away / radius, -1.0, 1.0)));
}

/// A lower bound [m] on the way from a pose to a goal under a turning radius [m], without walls. On
/// the shortest way to a line the robot turns towards its normal and goes on straight. A disc lies
/// behind the tangent on its near side in every direction; the greatest of these bounds is taken.
double turning_length(const Pose& start, const GoalRegion& goal, double radius) {
  const double dx = goal.point.x - start.x;
  const double dy = goal.point.y - start.y;
  if (goal.kind == GoalRegion::Kind::kLine) {
    return turning_length(std::atan2(goal.normal.y, goal.normal.x),
                          goal.normal.x * dx + goal.normal.y * dy, start, radius);
  }
  double longest = 0.0;
  for (int i = 0; i < kDirections; ++i) {
    const double heading = i * (2.0 * std::numbers::pi / kDirections);
    const double away = std::cos(heading) * dx + std::sin(heading) * dy - goal.radius;
    longest = std::max(longest, turning_length(heading, away, start, radius));
  }
  return longest;
}

}  // namespace

LengthBound::LengthBound(const StaticMap& map, const Pose& start, const GoalRegion& goal,
                         double mass, double inscribed_radius, double turning_radius)
    : mass_(mass),
      length_(turning_radius > 0.0 ? turning_length(start, goal, turning_radius)
                                   : goal.distance({start.x, start.y})) {
  const double clearance = (1.0 - kSlim) * inscribed_radius;
  const Vec2 place{start.x, start.y};
  if (map.cores().vertices.size() > ShortestPath::kSomeCorners) return;
  // a path that first leaves the surroundings of a wall proves nothing
  if (!GrownMap::of(map, clearance)->keeps_clearance(place)) return;
  path_.emplace(map, clearance, place, regions_of(goal), Estimates::kNever);
}

bool LengthBound::run() {
  if (!path_) return true;
  if (!path_->run()) return false;
  if (std::isfinite(path_->length())) {
    length_ = std::max(length_, path_->length() / (1.0 + path_->map().excess()));
  }
  path_.reset();
  return true;
}

}  // namespace pushplan
