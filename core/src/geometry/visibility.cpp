#include "pushplan/geometry/visibility.hpp"

#include <cmath>

namespace pushplan {
BendGraph::BendGraph(const Bends& every, const Obstacles& obstacles, const Box& box, double gap) {
  for (std::size_t i = 0; i < every.points.size(); ++i) {
    const Vec2 p = every.points[i];
    if (!box.contains(p, gap) || obstacle_distance(p, obstacles) < gap) continue;
    points_.push_back(p);
    incoming_.push_back(every.incoming[i]);
    outgoing_.push_back(every.outgoing[i]);
  }
  lines_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Vec2 p = points_[i];
    for (std::size_t j = i + 1; j < points_.size(); ++j) {
      const Vec2 q = points_[j];
      const double dx = q.x - p.x;
      const double dy = q.y - p.y;
      if (!bends().tangent({dx, dy}, i, gap) || !bends().tangent({-dx, -dy}, j, gap)) continue;
      if (!line_of_sight(p, q, obstacles, gap)) continue;
      lines_[i].push_back({static_cast<Index>(j), std::hypot(dx, dy)});
      lines_[j].push_back({static_cast<Index>(i), std::hypot(dx, dy)});
    }
  }
}

void BendGraph::relax(std::span<double> distances, std::span<Index> parents) const {
  std::vector<char> done(distances.size(), 0);
  for (std::size_t round = 0; round < distances.size(); ++round) {
    Index node = -1;
    double best = kInfinity;
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (!done[i] && distances[i] < best) {
        node = static_cast<Index>(i);
        best = distances[i];
      }
    }
    if (node < 0) return;
    done[at(node)] = 1;
    for (const auto& [to, step] : lines_[at(node)]) {
      const double length = best + step;
      if (length < distances[at(to)]) {
        distances[at(to)] = length;
        parents[at(to)] = node;
      }
    }
  }
}

std::vector<double> BendGraph::distances() const {
  const std::size_t count = points_.size();
  std::vector<double> between(count * count, kInfinity);
  std::vector<Index> unused(count);
  for (std::size_t k = 0; k < count; ++k) {
    between[k * count + k] = 0.0;
    relax(std::span(between).subspan(k * count, count), unused);
  }
  return between;
}

GoalLeg goal_leg(Vec2 p, const GoalScene& scene) {
  GoalLeg best{kInfinity, p};
  for (Index k = 0; k < scene.regions.count(); ++k) {
    const Vec2 q = nearest_in_region(k, p, scene.regions);
    const double length = std::hypot(q.x - p.x, q.y - p.y);
    if (length < best.length && scene.box.contains(q, scene.gap) &&
        line_of_sight(p, q, scene.obstacles, scene.gap)) {
      best = {length, q};
    }
  }
  return best;
}

NodeLeg node_leg(Vec2 p, double limit, Index hint, bool tangent_only, const Nodes& nodes,
                 const Obstacles& obstacles, double gap) {
  NodeLeg best{limit, kNoLeg};
  const auto offer = [&](Index node) {
    const std::size_t i = at(node);
    const Vec2 q = nodes.places.points[i];
    const double dx = p.x - q.x;
    const double dy = p.y - q.y;
    const double left = best.distance - nodes.distances[i];
    if (dx * dx + dy * dy >= left * left || left <= 0.0) return;
    if (tangent_only && !nodes.places.tangent({dx, dy}, i, gap)) return;
    const double distance = nodes.distances[i] + std::sqrt(dx * dx + dy * dy);
    if (distance < best.distance && line_of_sight(p, q, obstacles, gap)) best = {distance, node};
  };
  if (hint >= 0) offer(hint);
  for (Index i = 0; i < nodes.places.count(); ++i) {
    if (nodes.distances[at(i)] >= best.distance) break;
    offer(i);
  }
  return best;
}

}  // namespace pushplan
