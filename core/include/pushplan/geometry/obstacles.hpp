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

/// Signed distance [m] of a point to a core, negative inside.
double core_distance(Vec2 p, Polygon core);

/// Distance [m] to the nearest obstacle: minus the greatest depth inside, infinite without any.
double obstacle_distance(Vec2 p, const Obstacles& obstacles);

/// True if the segment p-q comes closer than `margin` [m] to obstacle `k`.
bool crosses_obstacle(Vec2 p, Vec2 q, const Obstacles& obstacles, Index k, double margin);

/// True if the segment p-q stays at least `margin` [m] away from all obstacles.
bool line_of_sight(Vec2 p, Vec2 q, const Obstacles& obstacles, double margin);

/// Marks the points that lie in the box and `gap` or more off every obstacle. `keep` has as many
/// elements as there are points.
void free_points(std::span<const Vec2> points, const Obstacles& obstacles, const Box& box,
                 double gap, std::span<bool> keep);

}  // namespace pushplan
