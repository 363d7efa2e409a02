// A scene as a robot's own program describes it: plain values in SI units, world frame.
#pragma once

#include <limits>
#include <vector>

#include "pushplan/control/mpc/tracking.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan {

/// Corners of a convex polygon [m], in either order.
using Outline = std::vector<Vec2>;

enum class Drive {
  kDifferential,   // speed and turn rate are free
  kConstantSpeed,  // always at `max_speed`
  kCar             // turns on `turning_radius` at best
};

struct Robot {
  std::vector<Outline> parts{};  // of the footprint, in the body frame: x forward, y left
  double mass = 0.0;             // [kg]
  Drive drive = Drive::kDifferential;
  double max_speed = 0.0;       // [m/s]
  double max_turn_rate = 0.0;   // [rad/s]
  double turning_radius = 0.0;  // of a car at any speed [m]; 0 for other drives
  double max_acceleration = std::numeric_limits<double>::infinity();       // [m/s^2]
  double max_turn_acceleration = std::numeric_limits<double>::infinity();  // [rad/s^2]
};

/// Something that the robot may push.
struct Object {
  Outline outline{};  // where it is now
  double mass = 0.0;  // [kg]
};

struct World {
  Robot robot{};
  Pose robot_pose{};
  mpc::Twist robot_twist{};  // that it drives now
  std::vector<Outline> walls{};
  std::vector<Object> objects{};
  GoalRegion goal{};  // of the robot's origin; the normal of a line has length 1
  Box bounds{};       // within which the robot's origin has to stay
};

}  // namespace pushplan
