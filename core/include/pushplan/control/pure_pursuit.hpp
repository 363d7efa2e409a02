// Pure pursuit: steer at a point on the path a distance ahead (Coulter, CMU-RI-TR-92-01).
#pragma once

#include "pushplan/control/mpc/horizon.hpp"

namespace pushplan {

/// Speed and turn rate on the arc to the point `ahead` [m] of a place on a path [m].
mpc::Twist pursue(const mpc::ReferencePath& track, const Pose& pose, double place, double ahead,
                  const mpc::CommandLimits& limits);

/// Follows one path after the other. It allocates nothing.
class PurePursuit {
 public:
  PurePursuit(const mpc::CommandLimits& limits,
              double lookahead,          // [m]
              const mpc::Twist& before)  // the command in force
      : limits_(limits), lookahead_(lookahead), last_(before) {}

  /// Begins a path.
  void begin_track() { place_ = 0.0; }

  /// The command for where the robot is; it stops, or drives on straight if it cannot, at the end
  /// of the path, where there is none, and where the pose is not finite.
  mpc::Twist follow(const mpc::ReferencePath& track, const Pose& pose,
                    double held);  // from the last call to this one [s]

 private:
  mpc::CommandLimits limits_;
  double lookahead_;
  double place_ = 0.0;  // [m]
  mpc::Twist last_;
};

}  // namespace pushplan
