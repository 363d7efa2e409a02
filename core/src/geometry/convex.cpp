#include "pushplan/geometry/convex.hpp"

#include <cmath>

namespace pushplan {
namespace {

/// The outward edge normal of `a` along which `b` is farthest away, and how far [m].
struct Gap {
  double width;
  Vec2 normal;
};

Gap widest_gap(Polygon a, Polygon b) {
  Gap best{-kInfinity, {1.0, 0.0}};
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t j = next_corner(a, i);
    double nx = a[j].y - a[i].y;
    double ny = a[i].x - a[j].x;
    const double length = std::sqrt(nx * nx + ny * ny);
    if (length == 0.0) continue;
    nx /= length;
    ny /= length;
    double width = kInfinity;
    for (const Vec2 corner : b) {
      width = std::min(width, (corner.x - a[i].x) * nx + (corner.y - a[i].y) * ny);
    }
    if (width > best.width) best = {width, {nx, ny}};
  }
  return best;
}

/// True if an edge of `a` has all of `b` on its outer side.
bool separated_by_edge(Polygon a, Polygon b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t j = next_corner(a, i);
    const double nx = a[j].y - a[i].y;
    const double ny = a[i].x - a[j].x;
    if (nx == 0.0 && ny == 0.0) continue;
    bool outside = true;
    for (const Vec2 corner : b) {
      if ((corner.x - a[i].x) * nx + (corner.y - a[i].y) * ny < 0.0) {
        outside = false;
        break;
      }
    }
    if (outside) return true;
  }
  return false;
}

/// The least squared distance [m^2] of a corner of `b` to an edge of `a`.
double least_corner_distance_squared(Polygon a, Polygon b) {
  double best = kInfinity;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec2 from = a[i];
    const Vec2 to = a[next_corner(a, i)];
    for (const Vec2 corner : b) {
      best = std::min(best, point_segment_distance_squared(corner, from, to));
    }
  }
  return best;
}

}  // namespace

Penetration convex_penetration(Polygon a, Polygon b) {
  const Gap of_a = widest_gap(a, b);
  const Gap of_b = widest_gap(b, a);
  if (of_a.width >= of_b.width) return {-of_a.width, of_a.normal};
  return {-of_b.width, {-of_b.normal.x, -of_b.normal.y}};
}

bool convex_overlap(Polygon a, Polygon b) {
  return !(separated_by_edge(a, b) || separated_by_edge(b, a));
}

double convex_distance(Polygon a, Polygon b) {
  if (convex_overlap(a, b)) return 0.0;
  // of two disjoint polygons, the nearest points include a corner of one
  return std::sqrt(
      std::min(least_corner_distance_squared(a, b), least_corner_distance_squared(b, a)));
}

}  // namespace pushplan
