#include "pushplan/planners/rearrangement/goal.hpp"

#include <algorithm>

#include "pushplan/geometry/convex.hpp"

namespace pushplan::rearrangement {

GoalTest::GoalTest(const Polygons& outlines, const ObjectGoal& goal)
    : outlines_(outlines), goal_(goal) {
  std::size_t most = 0;
  for (Index k = 0; k < outlines.count(); ++k) most = std::max(most, outlines[k].size());
  outline_.resize(most);
}

/// True if an object with its middle at a point could be where it belongs.
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

bool GoalTest::is_done(Index k, const Pose& pose) {
  if (pose.x >= 0.5 * kRemoved) return true;
  if (!may_be_done({pose.x, pose.y})) return false;
  const Polygon body = outlines_[k];
  transform(pose, body, outline_.data());
  const Polygon outline(outline_.data(), body.size());
  if (!goal_.is_receptacle) {
    return convex_penetration(outline, goal_.polygon).depth < -goal_.slack;
  }
  for (const GoalEdge& edge : goal_.edges) {
    for (const Vec2 corner : outline) {
      const double out = edge.normal.x * corner.x + edge.normal.y * corner.y;
      if (out > edge.offset - goal_.slack) return false;
    }
  }
  return true;
}

void GoalTest::all_done(std::span<const Pose> poses, std::span<bool> done) {
  for (std::size_t k = 0; k < poses.size(); ++k) {
    done[k] = is_done(static_cast<Index>(k), poses[k]);
  }
}

}  // namespace pushplan::rearrangement
