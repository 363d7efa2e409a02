#include "pushplan/geometry/polygon.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/geometry/convex.hpp"

namespace pushplan {
namespace {

constexpr double kSharp = 100.0 / 180.0 * std::numbers::pi;  // turn of a corner [rad]

/// The edge of a polygon from a corner on.
Vec2 edge_from(Polygon polygon, std::size_t i) {
  const Vec2 to = polygon[next_corner(polygon, i)];
  return {to.x - polygon[i].x, to.y - polygon[i].y};
}

Vec2 direction(Vec2 step) {
  const double length = std::hypot(step.x, step.y);
  return {step.x / length, step.y / length};
}

}  // namespace

double polygon_area(Polygon polygon) {
  double total = 0.0;
  // far from the origin the plain formula loses digits
  const Vec2 o = polygon[0];
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const double ax = polygon[i].x - o.x;
    const double ay = polygon[i].y - o.y;
    const double bx = polygon[i + 1].x - o.x;
    const double by = polygon[i + 1].y - o.y;
    total += ax * by - ay * bx;
  }
  return 0.5 * total;
}

Vec2 polygon_centroid(Polygon polygon) {
  const Vec2 o = polygon[0];
  double twice = 0.0;
  double mx = 0.0;
  double my = 0.0;
  double sx = 0.0;
  double sy = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t j = next_corner(polygon, i);
    const double ax = polygon[i].x - o.x;
    const double ay = polygon[i].y - o.y;
    const double bx = polygon[j].x - o.x;
    const double by = polygon[j].y - o.y;
    const double cross = ax * by - ay * bx;
    twice += cross;
    mx += (ax + bx) * cross;
    my += (ay + by) * cross;
    sx += ax;
    sy += ay;
  }
  if (twice == 0.0) {
    const auto n = static_cast<double>(polygon.size());
    return {o.x + sx / n, o.y + sy / n};
  }
  return {o.x + mx / (3.0 * twice), o.y + my / (3.0 * twice)};
}

double polygon_inertia(Polygon polygon) {
  const Vec2 centre = polygon_centroid(polygon);
  double twice = 0.0;
  double moment = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t j = next_corner(polygon, i);
    const double ax = polygon[i].x - centre.x;
    const double ay = polygon[i].y - centre.y;
    const double bx = polygon[j].x - centre.x;
    const double by = polygon[j].y - centre.y;
    const double cross = ax * by - ay * bx;
    twice += cross;
    moment += cross * (ax * ax + ay * ay + ax * bx + ay * by + bx * bx + by * by);
  }
  if (twice == 0.0) return 0.0;
  return moment / (6.0 * twice);
}

double inscribed_radius(Polygon outline) {
  double radius = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 edge = edge_from(outline, i);
    const double inside = edge.y * outline[i].x - edge.x * outline[i].y;
    radius = std::min(radius, inside / std::hypot(edge.x, edge.y));
  }
  return std::max(radius, 0.0);
}

double least_width(Polygon outline) { return convex_penetration(outline, outline).depth; }

std::vector<Vec2> grown_outline(Polygon outline, double margin) {
  std::vector<Vec2> corners;
  Vec2 before = direction(edge_from(outline, outline.size() - 1));
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 after = direction(edge_from(outline, i));
    const double turn = std::atan2(before.x * after.y - before.y * after.x,
                                   before.x * after.x + before.y * after.y);
    const bool sharp = turn > kSharp && margin > 0.0;
    const double reach = std::tan((sharp ? 0.25 : 0.5) * turn);  // to where the sides meet
    const auto add = [&](Vec2 side, double ahead) {
      corners.push_back({outline[i].x + margin * (side.y + ahead * side.x),
                         outline[i].y + margin * (ahead * side.y - side.x)});
    };
    add(before, reach);
    if (sharp) add(after, -reach);
    before = after;
  }
  return corners;
}

}  // namespace pushplan
