#include "pushplan/motion/path_problem.hpp"

namespace pushplan {

Index lay_out(const Pose& start, std::span<const Arc> arcs, const SweptPath& path,
              const PathProblem& problem) {
  path.poses[0] = start;
  path.curvatures[0] = 0.0;
  const Index found = sample_arcs(start, arcs, problem.spacing, path.buffer().from(1));
  if (found < 0) return 0;
  if (problem.goal.has_heading()) return found + 1;
  for (Index i = 0; i <= found; ++i) {
    const Pose& pose = path.poses[static_cast<std::size_t>(i)];
    if (problem.goal.contains({pose.x, pose.y})) return i + 1;
  }
  return found + 1;
}

}  // namespace pushplan
