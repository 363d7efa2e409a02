// Footprints that are grown by a margin, and the margin that a robot can keep.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "pushplan/geometry/polygon.hpp"
#include "pushplan/geometry/static_map.hpp"
#include "pushplan/motion/collision.hpp"

namespace pushplan {

/// The parts of a robot that count at walls, grown by a margin [m]; it owns their corners.
class OwnFootprint {
 public:
  OwnFootprint(Polygons parts, double margin) {
    for (Index k = 0; k < parts.count(); ++k) parts_.add(grown_outline(parts[k], margin));
    for (const Vec2 p : parts_.vertices) radius_ = std::max(radius_, std::hypot(p.x, p.y));
  }

  Footprint view() const { return {parts_.polygons(), radius_}; }

 private:
  OwnPolygons parts_;
  double radius_ = 0.0;  // circumscribed [m]
};

/// The clearance [m] that a robot can keep from a pose on; none if it overlaps a wall there. One
/// that is nearer to a wall than the margin keeps a fraction of that.
inline std::optional<double> start_margin(Polygons wall_parts, const ConvexObstacles& walls,
                                          double margin, const Pose& pose) {
  for (const double fraction : {1.0, 0.5, 0.25, 0.1, 0.0}) {
    const OwnFootprint grown(wall_parts, fraction * margin);
    if (CollisionChecker(grown.view(), walls).is_free(pose)) return fraction * margin;
  }
  return {};
}

}  // namespace pushplan
