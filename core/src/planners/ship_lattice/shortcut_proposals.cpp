#include "pushplan/planners/ship_lattice/shortcut_proposals.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

constexpr double kThrough = 0.9;  // changes below this lead through a displaced pose

/// Another end on the line, `aside` [m] beside the one that there is.
Pose displace_end(const Pose& end, double aside, const ChangeDraw& draw, const ChangeShift& shift,
                  const ChangeProblem& problem) {
  const Vec2 point = problem.goal.point;
  const Vec2 normal = problem.goal.normal;
  const double gap = (end.x - point.x) * normal.x + (end.y - point.y) * normal.y;
  const bool straight = draw.kind < 0.5 * problem.end_fraction;
  return {
      end.x - gap * normal.x - aside * normal.y, end.y - gap * normal.y + aside * normal.x,
      straight ? std::atan2(normal.y, normal.x) + 0.1 * shift.turn : end.theta + 0.2 * shift.turn};
}

}  // namespace

ChangedPath propose_change(const Path& path, const ChangeDraw& draw, const ChangeShift& shift,
                           const ChangeProblem& problem, const PathBuffer& out) {
  const Index count = path.size();
  if (count < 6 || out.size() < 2 * count) return {0, 0, 0};
  const auto span = static_cast<Index>(4.0 + static_cast<double>(count - 5) * draw.span);
  const double aside = problem.spread * std::pow(10.0, -1.3 * draw.scale) * shift.sideways;
  if (draw.kind < problem.end_fraction) {  // another end: sideways, and straight into the line
    const Index first = std::max(Index{0}, count - 1 - span);
    const Pose end = displace_end(path.poses[at(count - 1)], aside, draw, shift, problem);
    const Index size = copy_start(path, first, out);
    const Index added = lay_dubins(path.poses[at(first)], end, problem.limits, out.from(size));
    if (added < 1) return {first, 0, 0};
    return {first, size + added, size + added};
  }
  const auto first = static_cast<Index>(draw.place * static_cast<double>(count - span));
  const Index last = std::min(first + span, count - 1);
  Index size = copy_start(path, first, out);
  if (draw.kind < kThrough) {
    const Pose via = displace(path.poses[at((first + last) / 2)], aside, 0.15 * shift.turn);
    const Index added = lay_dubins(path.poses[at(first)], via, problem.limits, out.from(size));
    if (added < 1) return {first, 0, 0};
    size += added;
  }
  const Index added =
      lay_dubins(out.poses[at(size - 1)], path.poses[at(last)], problem.limits, out.from(size));
  if (added < 1 || size + added + count - last > out.size()) return {first, 0, 0};
  size += added;
  return {first, size, copy_rest(path, last, out, size)};
}

}  // namespace pushplan
