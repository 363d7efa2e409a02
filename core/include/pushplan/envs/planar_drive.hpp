// Driving a kinematic robot through a scene, substep by substep, without jamming it.
#pragma once

#include <span>
#include <vector>

#include "pushplan/envs/chipmunk.hpp"

namespace pushplan {

/// One step of the robot, in equal substeps.
struct DriveStep {
  double linear;    // speed at the bearing [m/s]
  double angular;   // [rad/s]
  double duration;  // [s]
  double course;    // direction in the world that it keeps while it turns [rad]
  double bearing;   // of its motion in the body frame, 0 ahead [rad]
  bool holds;       // true if it keeps it; else it drives an arc
  Index samples;    // states that are recorded
  Index each;       // substeps between two of them
};

/// Moves the robot as commanded, or as nearly as it can.
///
/// A kinematic robot has no limit of force, and would press an object through a wall. So a substep
/// after which some overlap has grown past the tolerance, while something static is touched, is
/// taken back. Until the next sample the robot then turns on the spot as commanded or, where that
/// is no better, turns and gives way backwards; if it can do neither it stays where it is for the
/// rest of the step.
class PlanarDrive {
 public:
  PlanarDrive(ChipmunkScene& scene, double radius,  // circumscribed, of the robot [m]
              double tolerance);                    // overlap at which it is held [m]

  /// Runs the substeps of one step.
  void run(const DriveStep& step, std::span<const Index> active,  // (A,) objects to load
           std::span<const BodyState> start,                      // (1 + A,)
           std::span<BodyState> states);  // (samples * (1 + A),) filled, a sample after the other

  /// Moves the robot at one velocity in the world frame until it is done or held.
  void sweep(const Twist& robot, double h,  // of a substep [s]
             Index count, std::span<const Index> active, std::span<const BodyState> start,
             std::span<BodyState> end);  // (1 + A,) filled

  /// True if the robot was kept from moving as commanded in the last run.
  bool held() const { return held_; }

 private:
  /// Part of the wanted motion that a substep has made.
  enum class Moved { kAll, kSome, kNothing };

  bool try_run(const DriveStep& step, std::span<const Index> active,
               std::span<const BodyState> start, bool careful, std::span<BodyState> states);
  Moved substep(const Twist& robot, double h, bool is_first);
  bool attempt(const Twist& robot, double h, double allowed);
  bool is_sound(double allowed);

  ChipmunkScene& scene_;
  double radius_;
  double tolerance_;
  bool held_ = false;
  bool measured_ = false;  // true if the depth after the last substep is known
  double deepest_ = 0.0;   // that depth [m]
  double yielding_ = 0.0;  // speed at which a held robot gives way [m/s]
  std::size_t count_ = 0;  // of loaded bodies
  std::vector<BodyState> before_;
  std::vector<BodyState> resting_;
};

}  // namespace pushplan
