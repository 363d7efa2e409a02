#include "pushplan/planners/mppi/rollout.hpp"

#include <cmath>

namespace pushplan {
namespace {

/// The nearest value to `wanted` within `change` of the last one.
double towards(double last, double wanted, double change) {
  return std::min(std::max(wanted, last - change), last + change);
}

/// The speed and the turn rate that a robot comes to in a step.
DriveCommand follow(const DriveCommand& last, const DriveCommand& control,
                    const DriveLimits& limits) {
  double speed = towards(last.linear, control.linear * limits.max_speed, limits.speed_change);
  speed = std::min(std::max(speed, limits.min_speed), limits.max_speed);
  const double rate =
      towards(last.angular, control.angular * limits.max_turn_rate, limits.turn_change);
  double most = limits.max_turn_rate;
  if (limits.turning_radius > 0.0) {
    most = std::min(most, std::abs(speed) / limits.turning_radius);
  }
  return {speed, std::min(std::max(rate, -most), most)};
}

/// Rolls out one control sequence after the other, with the memory of a collision checker.
class RobotRollout {
 public:
  explicit RobotRollout(const RolloutProblem& problem)
      : problem_(problem), checker_(problem.footprint, problem.walls) {}

  /// Drives from the first pose of a path on, which is filled in, and to the last one that is
  /// reached.
  void roll(std::span<const DriveCommand> controls, DriveCommand twist, std::span<Pose> path,
            std::span<DriveCommand> twists) {
    last = 0;
    outcome = RolloutOutcome::kDriven;
    for (std::size_t h = 0; h < controls.size(); ++h) {
      twist = follow(twist, controls[h], problem_.limits);
      twists[h] = twist;
      if (outcome == RolloutOutcome::kDriven) drive(twist, path);
    }
  }

  Index last = 0;  // index of the last pose that is reached
  RolloutOutcome outcome = RolloutOutcome::kDriven;

 private:
  void drive(const DriveCommand& twist, std::span<Pose> path) {
    const double part = problem_.period / static_cast<double>(problem_.substeps);
    for (Index i = 0; i < problem_.substeps; ++i) {
      const auto here = static_cast<std::size_t>(last);
      Pose& pose = path[here + 1];
      pose = arc_step(path[here], twist.linear * part, twist.angular * part);
      if (is_blocked(pose)) {
        outcome = RolloutOutcome::kBlocked;
        return;
      }
      ++last;
      if (problem_.has_goal && problem_.goal.contains({pose.x, pose.y})) {
        outcome = RolloutOutcome::kReached;
        return;
      }
    }
  }

  bool is_blocked(const Pose& pose) {
    if (checker_.is_free(pose)) return false;
    return problem_.allowed <= 0.0 || checker_.depth(pose) > problem_.allowed;
  }

  const RolloutProblem& problem_;
  CollisionChecker checker_;
};

}  // namespace

void roll_robots(ArrayView<const DriveCommand, 2> controls, const Pose& start,
                 const DriveCommand& before, const RolloutProblem& problem, const Rollouts& out) {
  RobotRollout rollout(problem);
  for (Index s = 0; s < controls.extent(0); ++s) {
    const auto at = static_cast<std::size_t>(s);
    out.paths(s, Index{0}) = start;
    rollout.roll(controls.row(s), before, out.paths.row(s), out.twists.row(s));
    out.ends[at] = rollout.last;
    out.outcomes[at] = rollout.outcome;
  }
}

}  // namespace pushplan
