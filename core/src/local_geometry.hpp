// Geometry that rooms beside it need: tests of convex polygons, distances, filled polygons.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/geometry/pose.hpp"

namespace pushplan::local {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Area [m^2] by the shoelace formula, positive if counter-clockwise. At least one corner.
inline double polygon_area(Polygon polygon) {
  double total = 0.0;
  const Vec2 origin = polygon[0];  // far from it the plain formula loses digits
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const double ax = polygon[i].x - origin.x;
    const double ay = polygon[i].y - origin.y;
    const double bx = polygon[i + 1].x - origin.x;
    const double by = polygon[i + 1].y - origin.y;
    total += ax * by - ay * bx;
  }
  return 0.5 * total;
}

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

/// True if an edge of `a` has all of `b` on its outer side.
inline bool is_separated_by_edge(Polygon a, Polygon b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec2 next = a[i + 1 < a.size() ? i + 1 : 0];
    const double nx = next.y - a[i].y;
    const double ny = a[i].x - next.x;
    if (nx == 0.0 && ny == 0.0) continue;
    const bool outside = std::none_of(b.begin(), b.end(), [&](Vec2 p) {
      return (p.x - a[i].x) * nx + (p.y - a[i].y) * ny < 0.0;
    });
    if (outside) return true;
  }
  return false;
}

/// True if two convex polygons overlap; touching does not count.
inline bool convex_overlap(Polygon a, Polygon b) {
  return !(is_separated_by_edge(a, b) || is_separated_by_edge(b, a));
}

/// Least squared distance [m^2] of a corner of `b` to an edge of `a`.
inline double least_corner_distance_squared(Polygon a, Polygon b) {
  double best = kInfinity;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec2 next = a[i + 1 < a.size() ? i + 1 : 0];
    for (const Vec2 p : b) best = std::min(best, point_segment_distance_squared(p, a[i], next));
  }
  return best;
}

/// Distance [m] between two convex polygons, 0 if they overlap.
inline double convex_distance(Polygon a, Polygon b) {
  if (convex_overlap(a, b)) return 0.0;
  // of two disjoint polygons, the nearest points include a corner of one
  return std::sqrt(
      std::min(least_corner_distance_squared(a, b), least_corner_distance_squared(b, a)));
}

/// Signed distance [m] of a point to a convex core of two or more corners, negative inside.
inline double core_distance(Vec2 p, Polygon core) {
  double best = kInfinity;
  bool inside = core.size() > 2;
  for (std::size_t i = 0; i < core.size(); ++i) {
    const Vec2 a = core[i];
    const Vec2 b = core[i + 1 < core.size() ? i + 1 : 0];
    best = std::min(best, point_segment_distance_squared(p, a, b));
    if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) < 0.0) inside = false;
  }
  const double distance = std::sqrt(best);
  return inside ? -distance : distance;
}

/// The first and the last of `count` pixels whose centres are within `low` to `high` [px].
struct PixelRange {
  Index first;
  Index last;
};

inline PixelRange pixels_between(double low, double high, Index count) {
  return {std::max(Index{0}, static_cast<Index>(std::ceil(std::max(low, 0.0) - 0.5))),
          std::min(count - 1, static_cast<Index>(std::floor(
                                  std::min(high, static_cast<double>(count)) - 0.5)))};
}

/// Sets the pixels whose centres are in a convex polygon with corners in pixel coordinates.
template <class T>
void fill_convex(ArrayView<T, 2> image, Polygon polygon, T value) {
  const Index rows = image.extent(0);
  const Index cols = image.extent(1);
  double low = kInfinity;
  double high = -kInfinity;
  for (const Vec2 corner : polygon) {
    low = std::min(low, corner.y);
    high = std::max(high, corner.y);
  }
  if (!(low <= static_cast<double>(rows) && high >= 0.0)) return;  // NaN too
  const PixelRange down = pixels_between(low, high, rows);
  for (Index r = down.first; r <= down.last; ++r) {
    const double y = static_cast<double>(r) + 0.5;
    double left = kInfinity;
    double right = -kInfinity;
    Vec2 from = polygon.back();
    for (const Vec2 to : polygon) {
      const Vec2 before = from;
      from = to;
      if ((before.y < y && to.y < y) || (before.y > y && to.y > y)) continue;
      if (before.y == to.y) {
        left = std::min(left, std::min(before.x, to.x));
        right = std::max(right, std::max(before.x, to.x));
      } else {
        const double x = before.x + (to.x - before.x) * (y - before.y) / (to.y - before.y);
        left = std::min(left, x);
        right = std::max(right, x);
      }
    }
    if (right < 0.0 || left > static_cast<double>(cols)) continue;
    const PixelRange across = pixels_between(left, right, cols);
    for (Index c = across.first; c <= across.last; ++c) image(r, c) = value;
  }
}

}  // namespace pushplan::local
