// Collision checks of a footprint: convex polygons against convex polygons.
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/obstacles.hpp"

namespace pushplan {

/// Convex parts of a robot in its body frame.
struct Footprint {
  Polygons parts;  // [m]
  double radius;   // circumscribed [m]
};

/// True if a disc comes closer to an obstacle than its radius [m].
bool disc_touches(Vec2 centre, double radius, const ConvexObstacles& obstacles);

/// Checks of a footprint among obstacles, with memory for one thread. The arrays of both have to
/// outlive it.
class CollisionChecker {
 public:
  CollisionChecker(const Footprint& footprint, const ConvexObstacles& obstacles);

  /// True if the footprint at a pose overlaps nothing and its origin is within the bounds.
  bool is_free(const Pose& pose);

  /// The number of the first pose that is not free, or how many there are.
  Index first_blocked(std::span<const Pose> poses);

  /// The depth of the footprint in the obstacles [m]; 0 where it is free.
  double depth(const Pose& pose);

  const Footprint& footprint() const { return footprint_; }
  const ConvexObstacles& obstacles() const { return obstacles_; }

 private:
  bool overlaps(Polygon obstacle) const;
  /// True if the footprint overlaps one of a group; `placed` says whether its corners are there.
  bool touches(const Pose& pose, Index group, bool& placed);

  Footprint footprint_;
  ConvexObstacles obstacles_;
  std::vector<Vec2> corners_;  // of the footprint in the world frame
  std::vector<Index> near_;    // groups that some poses in a row may reach
};

}  // namespace pushplan
