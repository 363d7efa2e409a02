// The pushing controller: from the poses of robot and box to a command.
#pragma once

#include <optional>
#include <span>

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

/// The sides of a box, F of them, on one bumper.
struct Faces {
  std::span<const FaceScore> scores;
  std::span<const BoxContact> contacts;
  std::span<const double> normals;     // direction of the inward normal in the box's frame [rad]
  std::span<const double> curvatures;  // as `PushWeights.curvature` [1/m]
};

struct PushTuning {
  PushWeights weights;            // but for length and curvature, which are of the face
  std::span<const Index> groups;  // (N,) which of the M commands holds in each step
  double reach;                   // of the steps at full speed [L]
  double delay;                   // between a command and its effect [s]
  double gain;                    // fraction by which an observation corrects what was predicted
};

/// Pushes one box along one path. A caller makes each step: `observe` puts up the program, a solver
/// solves it, `drive` gives the command. All arrays have to outlive it.
class PushTracker {
 public:
  PushTracker(const mpc::Horizon& horizon, const PushTuning& tuning, const Faces& faces,
              const Clearance& clearance);

  /// Begins a path with a push along a direction [rad, box frame].
  void begin(double direction);

  /// Estimates the state from poses, and puts up the program for when a command takes effect. False
  /// at the end of the path.
  bool observe(const mpc::ReferencePath& track, const Pose& robot, const Pose& box,
               double time,   // of the poses [s]
               double held);  // from the last call to this one [s]

  /// Puts up the program about the nominal commands.
  void assemble(const mpc::ReferencePath& track, double held);

  /// The command: of the solution if the program was `solved`, or the last one, as fast as what is
  /// static allows.
  Twist drive(const Obstacles& obstacles, bool solved, double time, double held);

  /// A command within the accelerations, which is remembered.
  Twist send(const Twist& wanted, double time, double held);

  /// The face that is pushed.
  Index face() const { return static_cast<Index>(face_); }
  /// Path length that the box has got to [m].
  double along() const { return along_; }
  /// Distance of the box from its path, left positive [m].
  double lateral() const { return lateral_; }
  /// Fraction of the last command that is driven.
  double slowed() const { return slowed_; }
  /// Cost of the nominal commands.
  double value() const { return value_; }
  /// The state as estimated.
  const PushState& state() const { return state_; }
  /// The state predicted for when a command of now takes effect.
  const PushState& state_in_effect() const { return guess_; }

 private:
  const BoxContact& contact() const { return faces_.contacts[face_]; }
  void estimate(const Pose& robot, const Pose& box, double time);
  void take_face(double direction);
  void correct(const PushState& seen, double time);
  void predict(double begin, double end);
  void begin_commands(double held);
  void shift(double held);
  PushingProblem problem_now(const mpc::ReferencePath& track, double held);

  mpc::Horizon horizon_;
  PushTuning tuning_;
  Faces faces_;
  Clearance clearance_;
  PushAssembly assembly_;
  std::size_t face_ = 0;
  double along_ = 0.0;
  double lateral_ = 0.0;
  double slowed_ = 1.0;
  double value_ = 0.0;
  double seen_at_ = 0.0;  // when the state was observed [s]
  bool observed_ = false;
  PushState state_{};
  PushState guess_{};
};

}  // namespace pushplan::pushing
