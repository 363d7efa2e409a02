// A geometric pushing controller: it steers the target object along a path.
//
// The robot heads where the object has to go, turned towards the side to which the object has
// slipped on the bumper.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan::rearrangement {

struct PushingController {
  double step;        // distance between two commands [m]
  double turn;        // greatest turn in one step [rad]
  double size;        // circumscribed radius of the robot [m]
  double half_width;  // of the bumper [m]
  double front;       // distance of the bumper ahead of the robot's origin [m]
  double ahead;       // look-ahead distance of the object on its path [m]
  double gain;        // curvature of the robot's path per radian off its heading, times `size`

  /// True if the middle of an object is in front of the bumper.
  bool on_bumper(const Pose& robot, const Pose& object) const;
};

/// What an object on a path aims at.
struct Carrot {
  Vec2 point;       // [m]
  double reached;   // arc length of the nearest point of the path [m]
  double distance;  // to that point [m]
};

/// The carrot `ahead` of the nearest point of a path, which is looked for from arc length `reached`
/// on. Beyond its end the path goes on straight. At least one point.
Carrot along_path(Vec2 at, std::span<const Vec2> path, double reached, double ahead);

struct PushCommand {
  double step;     // [m]
  double turn;     // [rad]
  double reached;  // arc length of the path that the object has got to [m]
  bool holds;      // the object is still on the bumper
};

/// The next step of a robot that pushes an object along a path.
PushCommand steer_push(const Pose& robot, const Pose& object, std::span<const Vec2> path,
                       double reached,  // arc length that the object has got to [m]
                       double shift,    // wanted offset of the robot to the left of the object [m]
                       const PushingController& controller);

}  // namespace pushplan::rearrangement
