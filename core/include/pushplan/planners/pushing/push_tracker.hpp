// The pushing controller: from the poses of robot and box to a command.
#pragma once

#include <optional>
#include <vector>

#include "pushplan/control/mpc/horizon.hpp"
#include "pushplan/planners/pushing/clearance.hpp"
#include "pushplan/planners/pushing/push_assembly.hpp"

namespace pushplan::pushing {

/// How well a push along a direction meets a face.
struct FaceScore {
  double x;  // cosine and sine of the face's inward normal in the box's frame, scaled
  double y;
  double bias;
};

/// A side of a box on the bumper.
struct Face {
  FaceScore score;
  BoxContact contact;
  double normal;     // direction of the inward normal in the box's frame [rad]
  double curvature;  // as `PushWeights.curvature` [1/m]
};

struct PushTuning {
  PushWeights weights;        // but for length, half and curvature, which are of the face
  std::vector<Index> groups;  // (N,) which of the M commands holds in each step
  double reach;               // of the steps at full speed [L]
  double delay;               // between a command and its effect [s]
  double gain;                // fraction by which an observation corrects what was predicted
};

/// A robot that pushes one box after the other along paths: `follow` gives a command, and allocates
/// nothing.
class PushTracker {
 public:
  PushTracker(const mpc::CommandLimits& limits, const PushTuning& tuning,
              const mpc::SolverSettings& solver,
              const Twist& before);  // the command in force

  /// Begins a path of a box, with a push along a direction [rad, box frame].
  void begin(std::vector<Face> faces, const Clearance& clearance, double direction);
  /// True if a path has begun.
  bool has_begun() const { return clearance_.has_value(); }

  /// The command for poses of robot and box: of the solution, or the last one, as fast as what is
  /// static allows. A stop at the end of the path, and for poses that are not finite.
  Twist follow(const mpc::ReferencePath& track, const Obstacles& obstacles, const Pose& robot,
               const Pose& box,
               double time,   // of the poses [s]
               double held);  // from the last call to this one [s]

  /// The nearest command to a stop.
  Twist stop(double time, double held) { return send({0.0, 0.0}, time, held); }

  /// The face that is pushed.
  Index face() const { return static_cast<Index>(face_); }
  /// Path length that the box has got to [m].
  double along() const { return along_; }
  /// Fraction of the last command that is driven.
  double slowed() const { return slowed_; }
  /// The state as estimated.
  const PushState& state() const { return state_; }
  /// The state predicted for when a command of now takes effect.
  const PushState& state_in_effect() const { return guess_; }
  /// The commands ahead, and how often the solver has failed.
  mpc::Horizon& horizon() { return horizon_; }

 private:
  const BoxContact& contact() const { return faces_[face_].contact; }
  void estimate(const Pose& robot, const Pose& box, double time);
  void take_face(double direction);
  void correct(const PushState& seen, double time);
  void predict(double begin, double end);
  bool advance_along(const mpc::ReferencePath& track);
  void begin_commands(double held);
  void shift(double held);
  PushingProblem problem_now(const mpc::ReferencePath& track, double held);
  Twist drive(const Obstacles& obstacles, bool solved, double time, double held);
  Twist send(const Twist& wanted, double time, double held);

  mpc::Horizon horizon_;
  PushTuning tuning_;
  std::vector<Face> faces_;
  std::optional<Clearance> clearance_;
  PushAssembly assembly_;
  std::size_t face_ = 0;
  double along_ = 0.0;
  double slowed_ = 1.0;
  double seen_at_ = 0.0;  // when the state was observed [s]
  bool observed_ = false;
  PushState state_{};
  PushState guess_{};
};

}  // namespace pushplan::pushing
