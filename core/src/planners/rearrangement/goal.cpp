#include "pushplan/planners/rearrangement/goal.hpp"

#include <algorithm>

#include "pushplan/geometry/convex.hpp"

namespace pushplan::rearrangement {

GoalTest::GoalTest(const Compounds& shapes, const ObjectGoal& goal) : shapes_(shapes), goal_(goal) {
  std::size_t most = 0;
  for (Index p = 0; p < shapes.parts.count(); ++p) most = std::max(most, shapes.parts[p].size());
  part_.resize(most);
}

/// True if a convex object with its middle at a point could be where it belongs.
bool GoalTest::may_be_done(Vec2 middle) const {
  if (goal_.is_receptacle) {
    return std::none_of(goal_.edges.begin(), goal_.edges.end(), [&](const GoalEdge& edge) {
      return edge.normal.x * middle.x + edge.normal.y * middle.y > edge.offset;
    });
  }
  const Polygon area = goal_.polygon;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const Vec2 a = area[i];
    const Vec2 b = area[next_corner(area, i)];
    if ((b.x - a.x) * (middle.y - a.y) - (b.y - a.y) * (middle.x - a.x) < 0.0) return true;
  }
  return false;
}

/// True if a part of an object, in the world frame, is where it belongs.
bool GoalTest::is_clear(Polygon part) const {
  if (!goal_.is_receptacle) return convex_penetration(part, goal_.polygon).depth < -goal_.slack;
  for (const GoalEdge& edge : goal_.edges) {
    for (const Vec2 corner : part) {
      const double out = edge.normal.x * corner.x + edge.normal.y * corner.y;
      if (out > edge.offset - goal_.slack) return false;
    }
  }
  return true;
}

bool GoalTest::is_done(Index k, const Pose& pose) {
  if (pose.x >= 0.5 * kRemoved) return true;
  const Index first = shapes_.begin(k);
  const Index last = shapes_.end(k);
  if (last - first == 1 && !may_be_done({pose.x, pose.y})) return false;
  for (Index p = first; p < last; ++p) {
    const Polygon body = shapes_.parts[p];
    transform(pose, body, part_.data());
    if (!is_clear({part_.data(), body.size()})) return false;
  }
  return true;
}

void GoalTest::all_done(std::span<const Pose> poses, std::span<bool> done) {
  for (std::size_t k = 0; k < poses.size(); ++k) {
    done[k] = is_done(static_cast<Index>(k), poses[k]);
  }
}

}  // namespace pushplan::rearrangement
