// The recovery behaviour: a drive out of a tight place that the robot itself is in.
#pragma once

#include <span>
#include <vector>

#include "pushplan/motion/collision.hpp"

namespace pushplan {

/// Length of a step [circumscribed radii], and turn of one on the spot [rad].
inline constexpr double kRecoveryStep = 0.08;

/// True if the disc that a robot of circumscribed radius `size` [m] needs to turn about is within
/// the bounds and free.
bool can_turn(Vec2 centre, double size, const ConvexObstacles& obstacles);

struct RecoveryStep {
  double distance;  // [m], negative for back
  double turn;      // [rad]
};

/// Start of a recovery path, and the obstacles that it must not touch.
struct RecoveryProblem {
  Pose start;
  std::span<const RecoveryStep> steps;  // that the robot may take
  Footprint body;
  Footprint grown;  // by the distance to keep from what it does not touch
  ConvexObstacles obstacles;
  double size;  // circumscribed radius of the robot [m]
};

/// The drive with the fewest steps to where the robot can turn, from its start on; empty if there
/// is none.
std::vector<Pose> recovery_path(const RecoveryProblem& problem);

}  // namespace pushplan
