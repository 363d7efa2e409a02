#include "pushplan/controllers.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

double circumscribed_radius(const Robot& robot) {
  double radius = 0.0;
  for (const Outline& part : robot.parts) {
    for (const Vec2 corner : part) radius = std::max(radius, std::hypot(corner.x, corner.y));
  }
  return radius;
}

mpc::CommandLimits command_limits(const Robot& robot) {
  return {.constant = robot.drive == Drive::kConstantSpeed,
          .min_speed = 0.0,
          .max_speed = robot.max_speed,
          .max_turn_rate = robot.max_turn_rate,
          .max_acceleration = robot.max_acceleration,
          .max_turn_acceleration = robot.max_turn_acceleration,
          .turning_radius = robot.turning_radius};
}

}  // namespace

PurePursuit make_pure_pursuit(const Robot& robot, const mpc::Twist& before) {
  return {command_limits(robot), circumscribed_radius(robot), before};
}

mpc::Tracker make_tracker(const Robot& robot, double delay, const mpc::Twist& before) {
  // the defaults of MpcConfig in the Python package, which describes them
  const double size = circumscribed_radius(robot);
  const mpc::Tuning tuning{.size = size,
                           .max_speed = robot.max_speed,
                           .max_turn_rate = robot.max_turn_rate,
                           .max_acceleration = robot.max_acceleration,
                           .stops = robot.drive != Drive::kConstantSpeed,
                           .optimise_speed = false,
                           .heading_weight = 0.5,
                           .turn_weight = 0.02,
                           .smoothness = 0.001,
                           .terminal = 4.0,
                           .speed_weight = 0.2};
  const mpc::SolverSettings solver{
      .tolerance = 1e-6, .iterations = 2000, .rounds = 1, .first_rounds = 4};
  constexpr Index kSteps = 20;
  constexpr double kReach = 3.0;  // of the steps at full speed [R]
  return {command_limits(robot),           tuning, solver, kSteps,
          kReach * size / robot.max_speed, delay,  before};
}

}  // namespace pushplan
