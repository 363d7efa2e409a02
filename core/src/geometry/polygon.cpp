#include "pushplan/geometry/polygon.hpp"

namespace pushplan {

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

}  // namespace pushplan
