// A turn on the spot that pushes what the footprint sweeps.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "pushplan/interaction/model.hpp"
#include "pushplan/motion/path_problem.hpp"

namespace pushplan {

/// The part of a turn that comes nearest to a wanted heading.
struct SpotTurn {
  double angle;               // [rad]
  double error;               // of the heading, that is left [rad]
  std::vector<Pose> objects;  // poses of the objects by then
};

/// Turns until something blocks it.
template <InteractionModel M>
SpotTurn turn_freely(const PathProblem& problem, M& model, const Pose& start,
                     std::span<const Pose> objects, double angle) {
  const auto steps = static_cast<Index>(std::ceil(std::abs(angle) / kMaxTurn));
  CollisionChecker checker(problem.footprint, problem.walls);
  SpotTurn best{0.0, std::abs(wrap_below_pi(angle)), {objects.begin(), objects.end()}};
  std::vector<Pose> poses = best.objects;
  std::vector<double> moved(poses.size(), 0.0);
  Pose last = start;
  for (Index step = 1; step <= steps; ++step) {
    const double turned = angle * static_cast<double>(step) / static_cast<double>(steps);
    const Pose here{start.x, start.y, start.theta + turned};
    if (!checker.is_free(here) || !model.advance(last, here, poses, moved)) break;
    last = here;
    const double error = std::abs(wrap_below_pi(angle - turned));
    if (error < best.error) {
      best.angle = turned;
      best.error = error;
      best.objects = poses;
    }
  }
  return best;
}

}  // namespace pushplan
