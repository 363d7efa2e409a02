#include "pushplan/motion/goal_approach.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>

#include "pushplan/motion/recovery.hpp"
#include "pushplan/motion/reeds_shepp.hpp"

namespace pushplan {
namespace {

// Ways before the end of a path at which a curve may leave it: first the short ones [radii]
constexpr std::array kNear{0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0};
constexpr std::array kFar{6.0, 9.0, 13.0, kInfinity};
constexpr double kInPlace = 0.999;  // distance from a goal at which the robot only turns [radii]
constexpr double kRoom = 1.1;       // free disc in which a robot turns [circumscribed radii]
constexpr double kRunUp = 12.0;     // longest straight way into a goal [circumscribed radii]
constexpr double kRunUpStep = 0.25;
constexpr double kMostPoses = 1e6;  // of an end
constexpr int kMostBoxes = 500;     // boxes of poses that are checked at most
constexpr double kWithin = 0.9;     // part of the tolerances that is used

/// A way to the goal from a pose of the path.
struct Curve {
  Index from;
  double length;  // of the path up to there and of the arcs [m]
  std::vector<Arc> arcs;
};

/// The curve to a pose, or to its place for a turn: none from within `near` [m].
Curve curve_from(std::span<const Pose> path, Index from, double along, const Pose& end,
                 const EndTurns& turns, bool on_spot, double near) {
  const Pose& start = path[static_cast<std::size_t>(from)];
  const double dx = end.x - start.x;
  const double dy = end.y - start.y;
  if (on_spot && std::hypot(dx, dy) <= near) return {from, along, {}};
  const double heading = on_spot ? std::atan2(dy, dx) : end.theta;
  const ShortestCurve way =
      shortest_curve(start, {end.x, end.y, heading}, turns.radius, turns.reverses);
  double length = 0.0;
  for (const Arc& arc : way.arcs) length += std::abs(arc.length);
  return {from, along + length, {way.arcs.begin(), way.arcs.end()}};
}

/// Curves from the path at some distances [radii] before its end, the shortest way first.
std::vector<Curve> curves_from(std::span<const double> back, std::span<const Pose> path,
                               std::span<const double> along, const Pose& end,
                               const EndTurns& turns, bool on_spot, double near) {
  std::vector<Index> places;
  for (const double radii : back) {
    const double at = along.back() - turns.radius * radii;
    places.push_back(std::ranges::lower_bound(along, at) - along.begin());
  }
  std::ranges::sort(places);
  places.erase(std::ranges::unique(places).begin(), places.end());
  std::vector<Curve> curves;
  for (const Index k : places) {
    const double before = along[static_cast<std::size_t>(k)];
    curves.push_back(curve_from(path, k, before, end, turns, on_spot, near));
  }
  std::ranges::stable_sort(curves, {}, &Curve::length);
  return curves;
}

/// Poses up to so far off a pose.
struct PoseBox {
  Pose middle;
  double half;  // along x and y [m]
  double turn;  // to either side [rad]
};

// Middles of the parts of a box that is halved along x and y, or of its turns
constexpr std::array kQuarters{Pose{-1.0, -1.0, 0.0}, Pose{-1.0, 1.0, 0.0}, Pose{1.0, -1.0, 0.0},
                               Pose{1.0, 1.0, 0.0}};
constexpr std::array kHalves{Pose{0.0, 0.0, -1.0}, Pose{0.0, 0.0, 1.0}};

}  // namespace

// Boxes of poses are halved, beginning with that of all tolerances, until the robot fits in the
// middle of one. A box is left out where no motion within it gets the footprint out of something.
std::optional<GoalRegion> fitting(const GoalRegion& goal, const Polygons& footprint, double size,
                                  const ConvexObstacles& walls) {
  CollisionChecker checker({footprint, size}, walls);
  std::deque<PoseBox> boxes{{{0.0, 0.0, 0.0}, goal.radius, goal.heading_tolerance}};
  for (int looked = 0; looked < kMostBoxes; ++looked) {
    if (boxes.empty()) return std::nullopt;
    auto [off, half, turn] = boxes.front();
    boxes.pop_front();
    const Pose pose{goal.point.x + off.x, goal.point.y + off.y, goal.heading + off.theta};
    const double away = std::hypot(off.x, off.y);
    const double aside = std::abs(off.theta);
    const double within = std::max(away / goal.radius, aside / goal.heading_tolerance);
    if (within <= kWithin && checker.is_free(pose)) {
      GoalRegion fitted = goal;
      fitted.point = {pose.x, pose.y};
      fitted.heading = pose.theta;
      fitted.radius -= away;
      fitted.heading_tolerance -= aside;
      return fitted;
    }
    const double reach = std::numbers::sqrt2 * half;
    const Pose inside{std::clamp(pose.x, walls.bounds.x_min, walls.bounds.x_max),
                      std::clamp(pose.y, walls.bounds.y_min, walls.bounds.y_max), pose.theta};
    const double outside = std::hypot(inside.x - pose.x, inside.y - pose.y);
    if (std::max(outside, away - goal.radius) > reach) continue;
    if (checker.depth(inside) > reach + size * turn) continue;
    const bool across = reach > size * turn;
    (across ? half : turn) *= 0.5;
    for (const Pose& step : across ? std::span<const Pose>(kQuarters) : kHalves) {
      const Pose to{off.x + half * step.x, off.y + half * step.y, off.theta + turn * step.theta};
      boxes.push_back({to, half, turn});
    }
  }
  return goal;
}

Pose behind(const GoalRegion& goal, double length) {
  return {goal.point.x - length * std::cos(goal.heading),
          goal.point.y - length * std::sin(goal.heading), goal.heading};
}

double run_up(const GoalRegion& goal, const EndTurns& turns, double size,
              CollisionChecker& checker) {
  const double room = turns.on_spot ? kRoom * size : turns.radius + size;
  std::array open{true, turns.reverses};  // ahead, and back
  for (int step = 0; step < static_cast<int>(kRunUp / kRunUpStep); ++step) {
    for (const std::size_t way : {0u, 1u}) {
      if (!open[way]) continue;
      const double length = (way == 0 ? 1.0 : -1.0) * step * kRunUpStep * size;
      const Pose pose = behind(goal, length);
      open[way] = checker.is_free(pose);
      if (open[way] && can_turn({pose.x, pose.y}, room, checker.obstacles())) return length;
    }
  }
  return 0.0;
}

std::optional<PathEnd> path_end(const GoalRegion& goal, std::span<const Pose> path,
                                const EndTurns& turns, double straight, CollisionChecker& checker) {
  std::vector<double> along{0.0};
  for (std::size_t i = 1; i < path.size(); ++i) {
    along.push_back(along.back() +
                    std::hypot(path[i].x - path[i - 1].x, path[i].y - path[i - 1].y));
  }
  const Pose begin = behind(goal, straight);
  const double near = straight == 0.0 ? kInPlace * goal.radius : 0.0;
  PathEnd end{};
  const auto is_free = [&](const Curve& curve) {
    const Pose& start = path[static_cast<std::size_t>(curve.from)];
    double steps = 0.0;
    for (const Arc& arc : curve.arcs) {
      steps += std::abs(arc.length) / step_along(arc.curvature, turns.spacing) + 1.0;
    }
    if (!(steps < kMostPoses)) return false;
    end.poses.resize(static_cast<std::size_t>(steps) + 1);
    end.curvatures.resize(end.poses.size());
    const Index count = sample_arcs(start, curve.arcs, turns.spacing, {end.poses, end.curvatures});
    end.poses.resize(static_cast<std::size_t>(count));
    end.curvatures.resize(end.poses.size());
    end.kept = curve.from + 1;
    return checker.first_blocked(end.poses) == count;
  };
  for (const bool on_spot : {true, false}) {
    if (on_spot && !turns.on_spot) continue;
    for (const std::span<const double> back : {std::span<const double>(kNear), {kFar}}) {
      for (Curve& curve : curves_from(back, path, along, begin, turns, on_spot, near)) {
        double turned = 0.0;
        for (const Arc& arc : curve.arcs) turned += arc.length * arc.curvature;
        const double arrived = path[static_cast<std::size_t>(curve.from)].theta + turned;
        const double angle = std::remainder(goal.heading - arrived, 2.0 * std::numbers::pi);
        const std::size_t arcs = curve.arcs.size();
        // the shorter way, and the longer one
        for (const double turn : {angle, angle - std::copysign(2.0 * std::numbers::pi, angle)}) {
          curve.arcs.resize(arcs);
          if (on_spot) curve.arcs.push_back({std::abs(turn), std::copysign(kInfinity, turn)});
          curve.arcs.push_back({straight, 0.0});
          if (is_free(curve)) return end;
          if (!on_spot) break;
        }
      }
    }
  }
  return std::nullopt;
}

std::optional<PathEnd> end_at_pose(const GoalRegion& goal, std::span<const Pose> path,
                                   const EndTurns& turns, bool reverses, const Footprint& footprint,
                                   double size, const ConvexObstacles& walls) {
  const GoalRegion place = fitting(goal, footprint.parts, size, walls).value_or(goal);
  CollisionChecker checker(footprint, walls);
  if (auto end = path_end(place, path, turns, 0.0, checker)) return end;
  const EndTurns before{turns.on_spot, reverses, turns.radius, turns.spacing};
  return path_end(place, path, turns, run_up(place, before, size, checker), checker);
}

}  // namespace pushplan
