// Distances of robot and box from static things under a command.
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/obstacles.hpp"
#include "pushplan/planners/pushing/box_motion.hpp"

namespace pushplan::pushing {

struct ClearanceLimits {
  double least;  // distance to keep [m]
  double slack;  // distance by which a body that is too near already may come nearer [m]
};

/// The distances of a robot and a box, with memory for one thread.
class Clearance {
 public:
  Clearance(const Polygons& parts,          // of the robot, then the box, in their frames [m]
            std::span<const double> radii,  // of the disc about the origin that holds each part [m]
            const ClearanceLimits& limits);

  /// Least distances from static things [m], negative inside one.
  struct Gaps {
    double robot;
    double box;
  };

  Gaps gaps(const BoxContact& contact,
            double normal,  // of the pushed face in the box's frame [rad]
            const PushState& state, const Obstacles& obstacles);

  /// Fraction of a command, held for a time [s], that keeps robot and box clear of static things.
  double free_fraction(const BoxContact& contact, double normal, const PushState& start,
                       const Twist& twist, double duration, const Obstacles& obstacles);

 private:
  double gap_of(Index part, const Pose& pose, double least, const Obstacles& obstacles);

  Polygons parts() const { return {vertices_, offsets_}; }

  std::vector<Vec2> vertices_;  // of the parts
  std::vector<Index> offsets_;
  std::vector<double> radii_;
  ClearanceLimits limits_;
  std::vector<Vec2> placed_;  // corners in the world
};

}  // namespace pushplan::pushing
