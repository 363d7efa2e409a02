#include "pushplan/geometry/regions.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

Vec2 nearest_in_disc(Vec2 p, const Disc& disc) {
  const Vec2 centre = disc.centre;
  const double distance = std::hypot(p.x - centre.x, p.y - centre.y);
  if (distance <= disc.radius) return p;
  const double fraction = disc.radius / distance;
  return {centre.x + fraction * (p.x - centre.x), centre.y + fraction * (p.y - centre.y)};
}

Vec2 nearest_in_half_plane(Vec2 p, const HalfPlane& plane) {
  const Vec2 n = plane.normal;
  const double missing = (plane.point.x - p.x) * n.x + (plane.point.y - p.y) * n.y;
  if (missing <= 0.0) return p;
  return {p.x + missing * n.x, p.y + missing * n.y};
}

Vec2 nearest_in_polygon(Vec2 p, Polygon polygon) {
  bool inside = polygon.size() > 2;
  double best = kInfinity;
  Vec2 nearest = p;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i];
    const Vec2 b = polygon[next_corner(polygon, i)];
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    if (dx * (p.y - a.y) - dy * (p.x - a.x) < 0.0) inside = false;
    const double length_squared = dx * dx + dy * dy;
    double t = 0.0;
    if (length_squared > 0.0) {
      t = std::min(1.0, std::max(0.0, ((p.x - a.x) * dx + (p.y - a.y) * dy) / length_squared));
    }
    const Vec2 q{a.x + t * dx, a.y + t * dy};
    const double d = (q.x - p.x) * (q.x - p.x) + (q.y - p.y) * (q.y - p.y);
    if (d < best) {
      best = d;
      nearest = q;
    }
  }
  return inside ? p : nearest;
}

/// Adds the points where segments enter a circle, or where they leave it with side 1.
void add_crossings(const Disc& disc, std::span<const Segment> sides, double side,
                   std::vector<Vec2>& found) {
  for (const auto& [from, to] : sides) {
    const double dx = to.x - from.x;
    const double dy = to.y - from.y;
    const double a = std::max(dx * dx + dy * dy, 1e-300);
    const double ox = from.x - disc.centre.x;
    const double oy = from.y - disc.centre.y;
    const double b = (dx * ox + dy * oy) / a;
    const double square = b * b - (ox * ox + oy * oy - disc.radius * disc.radius) / a;
    if (square < 0.0) continue;
    const double t = -b + side * std::sqrt(square);
    if (t >= 0.0 && t <= 1.0) found.push_back({from.x + t * dx, from.y + t * dy});
  }
}

}  // namespace

Vec2 nearest_in_region(Index k, Vec2 p, const Regions& regions) {
  const auto discs = static_cast<Index>(regions.discs.size());
  if (k < discs) return nearest_in_disc(p, regions.discs[at(k)]);
  k -= discs;
  const auto half_planes = static_cast<Index>(regions.half_planes.size());
  if (k < half_planes) return nearest_in_half_plane(p, regions.half_planes[at(k)]);
  return nearest_in_polygon(p, regions.polygons[k - half_planes]);
}

double region_distance(Vec2 p, const Regions& regions) {
  double best = kInfinity;
  for (Index k = 0; k < regions.count(); ++k) {
    const Vec2 q = nearest_in_region(k, p, regions);
    best = std::min(best, std::hypot(q.x - p.x, q.y - p.y));
  }
  return best;
}

std::vector<Vec2> segment_crossings(std::span<const Segment> first,
                                    std::span<const Segment> second) {
  std::vector<Vec2> found;
  for (const Segment& one : first) {
    const Vec2 p = one.from;
    const double dx = one.to.x - p.x;
    const double dy = one.to.y - p.y;
    for (const Segment& other : second) {
      const Vec2 a = other.from;
      const double ex = other.to.x - a.x;
      const double ey = other.to.y - a.y;
      const double across = dx * ey - dy * ex;
      if (across == 0.0) continue;
      const double t = ((a.x - p.x) * ey - (a.y - p.y) * ex) / across;
      const double u = ((a.x - p.x) * dy - (a.y - p.y) * dx) / across;
      if (t < 0.0 || t > 1.0 || u < 0.0 || u > 1.0) continue;
      found.push_back({p.x + t * dx, p.y + t * dy});
    }
  }
  return found;
}

std::vector<Vec2> region_crossings(const Regions& regions, std::span<const Segment> sides) {
  std::vector<Vec2> found;
  const auto add = [&](const Segment& edge) {
    const std::vector<Vec2> crossings = segment_crossings({&edge, 1}, sides);
    found.insert(found.end(), crossings.begin(), crossings.end());
  };
  for (const Disc& disc : regions.discs) {
    add_crossings(disc, sides, -1.0, found);
    add_crossings(disc, sides, 1.0, found);
  }
  double farthest = 0.0;
  for (const auto& [from, to] : sides) {
    farthest =
        std::max({farthest, std::abs(from.x), std::abs(from.y), std::abs(to.x), std::abs(to.y)});
  }
  for (const auto& [p, n] : regions.half_planes) {
    const double span = 2.0 * farthest + 1.0 + std::hypot(p.x, p.y);
    add({{p.x - span * n.y, p.y + span * n.x}, {p.x + span * n.y, p.y - span * n.x}});
  }
  for (Index k = 0; k < regions.polygons.count(); ++k) {
    const Polygon polygon = regions.polygons[k];
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      add({polygon[i], polygon[next_corner(polygon, i)]});
    }
  }
  return found;
}

}  // namespace pushplan
