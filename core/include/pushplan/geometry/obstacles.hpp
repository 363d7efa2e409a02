// Static obstacles: convex cores, each with a radius around it.
//
// A thick segment is exactly the points within its radius of its centre line, and a polygon grown
// by a clearance the points within that clearance of the polygon. Both are a core (2 or more
// corners) and a radius, so distances and lines of sight need no approximation of round corners.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// C grown convex cores.
struct Obstacles {
  Polygons cores;                 // corners [m], counter-clockwise; a segment has two
  std::span<const double> radii;  // (C,) how far each obstacle reaches beyond its core [m]
  std::span<const Box> boxes;     // (C,) around each obstacle, its radius included [m]

  Index count() const { return static_cast<Index>(radii.size()); }
};

/// S convex polygons in the world frame, in groups of neighbours.
struct ConvexObstacles {
  static constexpr Index kGroup = 16;  // polygons whose boxes are looked at together

  Polygons polygons;            // [m]
  std::span<const Box> boxes;   // (S,) around each
  std::span<const Box> groups;  // (ceil(S / kGroup),) around each group
  Box bounds;                   // the workspace; a pose outside is not free

  Index count() const { return static_cast<Index>(boxes.size()); }
  Index group_count() const { return static_cast<Index>(groups.size()); }
};

/// Signed distance [m] of a point to a core, negative inside.
double core_distance(Vec2 p, Polygon core);

/// Distance [m] to the nearest obstacle: minus the greatest depth inside, infinite without any.
double obstacle_distance(Vec2 p, const Obstacles& obstacles);

/// True if the segment p-q comes closer than `margin` [m] to obstacle `k`.
bool crosses_obstacle(Vec2 p, Vec2 q, const Obstacles& obstacles, Index k, double margin);

/// True if the segment p-q stays at least `margin` [m] away from all obstacles.
bool line_of_sight(Vec2 p, Vec2 q, const Obstacles& obstacles, double margin);

}  // namespace pushplan
