// Rollouts of pushes: the pushing controller in closed loop with quasi-static contacts.
//
// A *line* push drives straight ahead until it has done what it can. A *path-following* push steers
// one object along a path.
#pragma once

#include <span>
#include <vector>

#include "pushplan/interaction/quasi_static.hpp"
#include "pushplan/planners/rearrangement/controller.hpp"
#include "pushplan/planners/rearrangement/goal.hpp"

namespace pushplan::rearrangement {

/// Drives a step and moves the objects in the way, see `QuasiStatic::advance`. False if the robot
/// jams or hits a wall.
inline bool push_to(QuasiStatic& model, const Pose& here, const Pose& there, std::span<Pose> poses,
                    std::span<double> lengths) {
  return !model.robot_held(there) && model.advance(here, there, poses, lengths);
}

/// Number of stages of one push that are kept.
inline constexpr Index kStages = 8;

/// Arrays into which a rollout is written.
struct RolloutLog {
  std::span<Pose> track;         // the robot's poses; their number bounds the rollout
  std::span<Index> steps;        // (kStages,) how many poses each stage has
  ArrayView<Pose, 2> poses;      // (kStages, K) the objects' poses at the end of each stage
  ArrayView<double, 2> lengths;  // (kStages, K) their path lengths [m]
  Box* box;                      // around all that moved, and its surroundings [m]
};

/// A push to roll out.
struct PushAttempt {
  Index target;                  // object that follows the path, -1 for a line push
  std::span<const Vec2> path;    // of the target object [m]
  double shift;                  // see `steer_push`
  double limit;                  // greatest length of the robot's path [m]
  std::span<const bool> wanted;  // (K,) objects that are to be done; the push ends when all are
};

struct RolloutSize {
  Index stages;
  Index poses;  // of the robot
};

/// Rollouts with memory for one thread. The bodies' arrays and those of the goal have to outlive
/// it.
class PushRollout {
 public:
  PushRollout(const Bodies& bodies, const QuasiStaticSettings& settings, const ObjectGoal& goal);

  /// Number of objects.
  Index count() const { return static_cast<Index>(poses_.size()); }

  /// Pushes until nothing that is wanted can come of it. The last stage is kept however it ends.
  RolloutSize run(const Pose& start, std::span<const Pose> poses, const PushAttempt& attempt,
                  const PushingController& controller, const RolloutLog& log);

 private:
  bool update_done(Box& box, double margin);
  bool is_wanting(std::span<const bool> wanted) const;
  void write(const RolloutLog& log, RolloutSize& size) const;

  QuasiStatic model_;
  GoalTest goal_;
  std::vector<Pose> poses_;      // of the objects
  std::vector<Pose> saved_;      // before the step
  std::vector<double> lengths_;  // of the objects' paths [m]
  std::vector<char> done_;
};

/// The robot and the objects along short arcs of which every one begins at the same pose.
struct ArcSweep {
  struct Mark {
    Index arc;
    Index step;
  };

  ArrayView<Pose, 2> track;   // (A, steps + 1) poses of the robot, filled until it jams
  ArrayView<Pose, 3> poses;   // (A, steps + 1, K) poses of the objects, likewise
  std::vector<Mark> marks{};  // where the target has moved on by a distance
};

/// One step of an arc.
struct ArcStep {
  double distance;  // [m], negative for back
  double turn;      // [rad]
};

/// A distance between poses of an object.
struct ObjectStep {
  Index target;  // the object
  double size;   // length that counts as much as 5 rad [m]
  double least;  // distance, in sizes
};

/// Drives along arcs and fills `out`.
void sweep_arcs(QuasiStatic& model, const Pose& start, std::span<const Pose> poses,
                std::span<const ArcStep> arcs, const ObjectStep& mark, ArcSweep& out);

}  // namespace pushplan::rearrangement
