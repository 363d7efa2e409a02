#include "pushplan/geometry/obstacles.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/geometry/convex.hpp"

namespace pushplan {
namespace {

/// True if the segments p-q and a-b cross or are closer than the root of `reach_squared`.
bool segments_closer(Vec2 p, Vec2 q, Vec2 a, Vec2 b, double reach_squared) {
  const double dx = q.x - p.x;
  const double dy = q.y - p.y;
  const double ex = b.x - a.x;
  const double ey = b.y - a.y;
  const double side_a = dx * (a.y - p.y) - dy * (a.x - p.x);
  const double side_b = dx * (b.y - p.y) - dy * (b.x - p.x);
  const double side_p = ex * (p.y - a.y) - ey * (p.x - a.x);
  const double side_q = ex * (q.y - a.y) - ey * (q.x - a.x);
  if ((side_a > 0.0) != (side_b > 0.0) && (side_p > 0.0) != (side_q > 0.0)) return true;
  return point_segment_distance_squared(p, a, b) < reach_squared ||
         point_segment_distance_squared(q, a, b) < reach_squared ||
         point_segment_distance_squared(a, p, q) < reach_squared ||
         point_segment_distance_squared(b, p, q) < reach_squared;
}

}  // namespace

double core_distance(Vec2 p, Polygon core) {
  double best_squared = kInfinity;
  bool inside = core.size() > 2;
  for (std::size_t i = 0; i < core.size(); ++i) {
    const Vec2 a = core[i];
    const Vec2 b = core[next_corner(core, i)];
    best_squared = std::min(best_squared, point_segment_distance_squared(p, a, b));
    if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) < 0.0) inside = false;
  }
  const double distance = std::sqrt(best_squared);
  return inside ? -distance : distance;
}

double obstacle_distance(Vec2 p, const Obstacles& obstacles) {
  double best = kInfinity;
  for (Index k = 0; k < obstacles.count(); ++k) {
    best = std::min(best, core_distance(p, obstacles.cores[k]) - obstacles.radii[at(k)]);
  }
  return best;
}

bool crosses_obstacle(Vec2 p, Vec2 q, const Obstacles& obstacles, Index k, double margin) {
  const Box& box = obstacles.boxes[at(k)];
  if (std::max(p.x, q.x) < box.x_min - margin || std::min(p.x, q.x) > box.x_max + margin ||
      std::max(p.y, q.y) < box.y_min - margin || std::min(p.y, q.y) > box.y_max + margin) {
    return false;
  }
  const double dx = q.x - p.x;
  const double dy = q.y - p.y;
  const double length = std::sqrt(dx * dx + dy * dy);
  const Vec2 along = length > 0.0 ? Vec2{dx / length, dy / length} : Vec2{1.0, 0.0};
  const double reach = std::max(0.0, obstacles.radii[at(k)] + margin);
  const Polygon core = obstacles.cores[k];
  // extent of the core across the line
  double low = kInfinity;
  double high = -kInfinity;
  for (const Vec2 corner : core) {
    const double side = along.x * (corner.y - p.y) - along.y * (corner.x - p.x);
    low = std::min(low, side);
    high = std::max(high, side);
  }
  if (low >= reach || high <= -reach) return false;
  if (core.size() > 2 && core_distance(p, core) < 0.0) return true;
  for (std::size_t i = 0; i < core.size(); ++i) {
    if (segments_closer(p, q, core[i], core[next_corner(core, i)], reach * reach)) return true;
  }
  return false;
}

bool line_of_sight(Vec2 p, Vec2 q, const Obstacles& obstacles, double margin) {
  for (Index k = 0; k < obstacles.count(); ++k) {
    if (crosses_obstacle(p, q, obstacles, k, margin)) return false;
  }
  return true;
}

}  // namespace pushplan
