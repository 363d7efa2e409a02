#include <exception>
#include <utility>

#include "pushplan/navigation/pushing.hpp"
#include "pushplan/planner.hpp"

namespace pushplan {
namespace {

const char* reason_of(PlanStatus status) {
  switch (status) {
    case PlanStatus::kStartBlocked:
      return "the robot overlaps a wall, is out of the bounds, or has no room to get away";
    case PlanStatus::kGoalUnreachable:
      return "no way leads to the goal around the walls";
    case PlanStatus::kPathOnly:
      return "the robot cannot change its turn rate as fast as the plan does";
    case PlanStatus::kNoPlan:
      return "no plan was found within the budget";
    default:
      return "";
  }
}

double size_of(const Robot& robot) {
  double size = 0.0;
  for (const Outline& part : robot.parts) {
    for (const Vec2 p : part) size = std::max(size, std::hypot(p.x, p.y));
  }
  return size;
}

mpc::CommandLimits limits_of(const Robot& robot) {
  return {robot.drive == Drive::kConstantSpeed,
          0.0,
          robot.max_speed,
          robot.max_turn_rate,
          robot.max_acceleration,
          robot.max_turn_acceleration,
          robot.turning_radius};
}

}  // namespace

Plan plan(const World& world, const PlannerOptions& options, Index iterations,
          const std::function<bool()>& stop) {
  try {
    std::string fault = fault_of(world, options);
    if (!fault.empty()) return {PlanStatus::kInvalidInput, std::move(fault)};
    PathPlanner planner(world, options);
    do {
      planner.run(0);
    } while (!planner.done() && planner.counts().iterations < iterations && !(stop && stop()));
    Plan best = planner.best();
    best.message = reason_of(best.status);
    return best;
  } catch (const std::exception& error) {
    return {PlanStatus::kFailed, error.what()};
  } catch (...) {
    return {PlanStatus::kFailed, "the stop rule threw something that is no std::exception"};
  }
}

mpc::ReferencePath Plan::track() const {
  std::size_t count = poses.size();
  while (count > 1 && lengths[count - 1] == lengths[count - 2]) --count;  // without a last turn
  return {std::span(poses).first(count), std::span(lengths).first(count),
          std::span(speeds).first(count), last_heading};
}

PurePursuit make_pure_pursuit(const Robot& robot, const mpc::Twist& driven) {
  return {limits_of(robot), size_of(robot), driven};
}

mpc::Tracker make_tracker(const Robot& robot, const mpc::Twist& driven, double delay) {
  const double size = size_of(robot);
  const mpc::Tuning tuning{size,
                           robot.max_speed,
                           robot.max_turn_rate,
                           robot.max_acceleration,
                           robot.drive != Drive::kConstantSpeed,
                           false};
  return {limits_of(robot), tuning, {}, 20, 3.0 * size / robot.max_speed, delay, driven};
}

}  // namespace pushplan
