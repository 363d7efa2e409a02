#include "pushplan/geometry/visibility.hpp"

#include <cmath>
#include <limits>

namespace pushplan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

VisiblePairs visible_pairs(const Bends& bends, const Obstacles& obstacles, double gap) {
  VisiblePairs found;
  for (std::size_t i = 0; i < bends.points.size(); ++i) {
    const Vec2 p = bends.points[i];
    for (std::size_t j = i + 1; j < bends.points.size(); ++j) {
      const Vec2 q = bends.points[j];
      const double dx = q.x - p.x;
      const double dy = q.y - p.y;
      if (!bends.tangent({dx, dy}, i, gap) || !bends.tangent({-dx, -dy}, j, gap)) continue;
      if (!line_of_sight(p, q, obstacles, gap)) continue;
      found.pairs.push_back({static_cast<Index>(i), static_cast<Index>(j)});
      found.lengths.push_back(std::hypot(dx, dy));
    }
  }
  return found;
}

void relax(const Arcs& arcs, std::span<double> distances, std::span<Index> parents) {
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
    for (Index e = arcs.starts[at(node)]; e < arcs.starts[at(node) + 1]; ++e) {
      const std::size_t other = at(arcs.ends[at(e)]);
      const double length = best + arcs.lengths[at(e)];
      if (length < distances[other]) {
        distances[other] = length;
        parents[other] = node;
      }
    }
  }
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
