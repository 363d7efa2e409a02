// Tests between two convex polygons: penetration, overlap, distance.
#pragma once

#include <algorithm>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// The least translation that separates two convex polygons, or how far apart they are.
struct Penetration {
  double depth;  // [m]; <= 0 where they do not overlap
  Vec2 normal;   // unit, from the first polygon to the second
};

/// The least translation that separates two convex polygons (separating axis theorem). With depth
/// > 0 they overlap, and moving `b` by depth times normal just separates them. With depth <= 0 they
/// do not, and -depth is the widest gap along an edge normal, which is at most their distance.
Penetration convex_penetration(Polygon a, Polygon b);

/// True if two convex polygons overlap; touching does not count.
bool convex_overlap(Polygon a, Polygon b);

/// Distance [m] between two convex polygons, 0 if they overlap.
double convex_distance(Polygon a, Polygon b);

/// Squared distance [m^2] of a point to the segment from `a` to `b`.
inline double point_segment_distance_squared(Vec2 p, Vec2 a, Vec2 b) {
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const double px = p.x - a.x;
  const double py = p.y - a.y;
  const double length_squared = dx * dx + dy * dy;
  double t = 0.0;
  if (length_squared > 0.0) {
    t = std::min(1.0, std::max(0.0, (px * dx + py * dy) / length_squared));
  }
  const double ex = px - t * dx;
  const double ey = py - t * dy;
  return ex * ex + ey * ey;
}

}  // namespace pushplan
