// Goals as unions of convex regions: the nearest point of each, and where outlines cross.
#pragma once

#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

struct Disc {
  Vec2 centre;    // [m]
  double radius;  // [m]; 0 is a point
};

/// Everything on or beyond a line.
struct HalfPlane {
  Vec2 point;   // on the line [m]
  Vec2 normal;  // unit, into the half-plane
};

/// A union of convex regions, numbered in this order.
struct Regions {
  std::span<const Disc> discs;
  std::span<const HalfPlane> half_planes;
  Polygons polygons;  // two corners make a segment

  Index count() const {
    return static_cast<Index>(discs.size() + half_planes.size()) + polygons.count();
  }
};

/// The point of region `k` that is nearest to `p`: `p` itself if it is inside.
Vec2 nearest_in_region(Index k, Vec2 p, const Regions& regions);

/// Straight distance [m] to the nearest region, whatever lies between; infinite without any.
double region_distance(Vec2 p, const Regions& regions);

/// The points where one of the first segments crosses one of the second; in order of the first.
std::vector<Vec2> segment_crossings(std::span<const Segment> first,
                                    std::span<const Segment> second);

/// The points where outlines of the regions cross segments. A shortest path to a region ends at the
/// region's nearest point or, where an obstacle covers that, at one of these.
std::vector<Vec2> region_crossings(const Regions& regions, std::span<const Segment> sides);

}  // namespace pushplan
