// The end of a path at a goal with a heading: a turn on the spot, or a curve into the pose.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan {

/// How a robot turns at the end of a path.
struct EndTurns {
  bool on_spot;
  bool reverses;   // on curves
  double radius;   // least turning radius [m]
  double spacing;  // greatest distance between two poses [m]
};

/// The part of a path that takes the place of its last poses.
struct PathEnd {
  Index kept;                      // number of poses of the path before it
  std::vector<Pose> poses;         // (M,)
  std::vector<double> curvatures;  // (M,) that lead to them [1/m]; infinite on the spot
};

/// The goal, or where the robot does not fit in its middle, tolerances around where it does; none
/// if it fits nowhere. The parts of its footprint lie within `size` [m] of its origin.
std::optional<GoalRegion> fitting(const GoalRegion& goal, const Polygons& footprint, double size,
                                  const ConvexObstacles& walls);

/// The pose from which a straight way of some length [m] leads into the pose of a goal.
Pose behind(const GoalRegion& goal, double length);

/// The shortest straight way into the pose of a goal from where the robot, of a circumscribed
/// radius [m], has room to turn [m], negative for back; 0 where there is room at the goal, or no
/// such way.
double run_up(const GoalRegion& goal, const EndTurns& turns, double size,
              CollisionChecker& checker);

/// The shortest end of a path at the pose of a goal, driven straight at last over some length [m],
/// that touches nothing: with a turn on the spot if possible, else a curve. None if there is none.
std::optional<PathEnd> path_end(const GoalRegion& goal, std::span<const Pose> path,
                                const EndTurns& turns, double straight, CollisionChecker& checker);

/// The same where the robot fits into the goal, first without a straight way, then after one from
/// where it has room to turn, on which it may reverse.
std::optional<PathEnd> end_at_pose(const GoalRegion& goal, std::span<const Pose> path,
                                   const EndTurns& turns, bool reverses, const Footprint& footprint,
                                   double size, const ConvexObstacles& walls);

}  // namespace pushplan
