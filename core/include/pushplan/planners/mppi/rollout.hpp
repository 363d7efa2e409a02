// Rollouts: what the robot, and what it pushes, does under many control sequences.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "pushplan/interaction/model.hpp"
#include "pushplan/motion/arc_rollout.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan {

/// Speed and turn rate: as fractions of the greatest ones, or in m/s and rad/s.
struct DriveCommand {
  double linear;
  double angular;
};

/// Limits on the robot's motion within one step.
struct DriveLimits {
  double min_speed;       // [m/s]
  double max_speed;       // [m/s]
  double max_turn_rate;   // [rad/s]
  double speed_change;    // greatest change of the speed from step to step [m/s]
  double turn_change;     // the same of the turn rate [rad/s]
  double turning_radius;  // of a car, else 0 [m]
};

/// Robot, static obstacles and goal of rollouts.
struct RolloutProblem {
  double period;   // length of a step [s]
  Index substeps;  // poses in a step
  DriveLimits limits;
  Footprint footprint;
  ConvexObstacles walls;
  GoalRegion goal;
  bool has_goal;   // true if a rollout ends in the goal; false where objects have the goal
  double allowed;  // depth in what is static at the start [m]; a rollout may get out of it
};

/// Ends of a rollout: at the horizon, in the goal, or at something static or jammed.
enum class RolloutOutcome : Index { kDriven, kReached, kBlocked };

/// S rollouts of N + 1 poses among K objects, in memory of somebody else.
struct Rollouts {
  ArrayView<Pose, 2> paths;            // (S, N + 1) poses of the robot up to the end
  ArrayView<DriveCommand, 2> twists;   // (S, H) speed [m/s] and turn rate [rad/s] of each step
  std::span<Index> ends;               // (S,) index of the last pose that is reached
  std::span<RolloutOutcome> outcomes;  // (S,)
  ArrayView<Pose, 2> objects;          // (S, K) poses of the objects there
  std::span<double> works;             // (S,) sum of mass times path length of the objects [kg m]
};

/// Drives the robot by S control sequences, (S, H) as fractions of the greatest speed and turn
/// rate, until it is blocked or in the goal. `before` are its speed [m/s] and turn rate [rad/s]
/// before.
void roll_robots(ArrayView<const DriveCommand, 2> controls, const Pose& start,
                 const DriveCommand& before, const RolloutProblem& problem, const Rollouts& out);

/// Carries the objects along each path, which ends where the robot jams.
template <InteractionModel M>
void roll_objects(M& model, std::span<const Pose> start, const Rollouts& rollouts) {
  std::vector<double> moved(start.size());
  for (std::size_t s = 0; s < rollouts.ends.size(); ++s) {
    const auto row = static_cast<Index>(s);
    const auto path = rollouts.paths.row(row);
    const auto objects = rollouts.objects.row(row);
    std::copy(start.begin(), start.end(), objects.begin());
    std::fill(moved.begin(), moved.end(), 0.0);
    for (Index n = 0; n < rollouts.ends[s]; ++n) {
      const auto at = static_cast<std::size_t>(n);
      if (!model.advance(path[at], path[at + 1], objects, moved)) {
        rollouts.ends[s] = n;
        rollouts.outcomes[s] = RolloutOutcome::kBlocked;
        break;
      }
    }
    rollouts.works[s] = work_of(moved, model.inverse_masses());
  }
}

}  // namespace pushplan
