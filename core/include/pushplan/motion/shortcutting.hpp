// Shortcutting of drivable paths at random with Dubins curves, or
// with those of Reeds and Shepp where the robot may reverse.
//
// A piece of the path is replaced by such a curve, straight across, through a displaced pose, or
// to another end in the goal; the objects are swept along with the candidate from the piece on, and
// it is kept when m0 l0 + w sum(mi li) falls. Shortcutting is Geraerts and Overmars (2007); what is
// added is that the cost of every candidate holds the interaction that it would cause.
#pragma once

#include <algorithm>
#include <span>

#include "pushplan/motion/arc_rollout.hpp"
#include "pushplan/motion/path_problem.hpp"

namespace pushplan {

/// Random numbers of one shortcut, uniform in [0, 1).
struct ShortcutDraw {
  double span;   // of the piece
  double place;  // of the piece
  double kind;   // across, through another pose, or to another end
  double scale;  // of the displacement
};

/// Further ones, standard normal.
struct ShortcutShift {
  double sideways;
  double turn;
};

/// A candidate, of no poses if there is none.
struct ShortcutProposal {
  Index first;  // its last pose that is as in the path
  Index added;  // new poses after that
  Index size;   // of all poses
};

/// Writes a candidate for the first `count` poses of `path` into `trial`, without the objects.
ShortcutProposal propose_shortcut(const SweptPath& path, Index count, const ShortcutDraw& draw,
                                  const ShortcutShift& shift, const PathProblem& problem,
                                  const SweptPath& trial);

/// A path that is in use up to `count` poses, and its cost [kg m].
struct PricedPath {
  Index count;
  double cost;
};

/// Pairs of objects that may be tested for one shortcut; that takes some milliseconds.
inline constexpr Index kShortcutPatience = 1'500;

/// Tries a shortcut for each draw; `path` is changed in place. `trial` is memory of the same size.
template <InteractionModel M>
PricedPath shortcut(const SweptPath& path, PricedPath known, std::span<const ShortcutDraw> draws,
                    std::span<const ShortcutShift> shifts, const SweptPath& trial,
                    const PathProblem& problem, M& model) {
  CollisionChecker checker(problem.footprint, problem.walls);
  PathSweep<M> sweep(problem, model);
  auto [count, cost] = known;
  for (std::size_t i = 0; i < draws.size() && count >= 4; ++i) {
    const auto [first, added, size] =
        propose_shortcut(path, count, draws[i], shifts[i], problem, trial);
    if (size == 0) continue;
    const auto from = static_cast<std::size_t>(first);
    const auto end = static_cast<std::size_t>(size);
    // no sweep can make up for a path that is too long by itself
    double length = path.lengths[from];
    for (std::size_t n = from + 1; n < end; ++n) {
      const double dx = trial.poses[n].x - trial.poses[n - 1].x;
      const double dy = trial.poses[n].y - trial.poses[n - 1].y;
      length += std::sqrt(dx * dx + dy * dy);
    }
    if (problem.robot_mass * length + problem.push_weight * path.works[from] >= cost) continue;
    const auto fresh = trial.poses.subspan(from + 1, static_cast<std::size_t>(added));
    if (checker.first_blocked(fresh) < added) continue;
    trial.lengths[from] = path.lengths[from];
    trial.works[from] = path.works[from];
    std::copy_n(path.objects.row(first).begin(), path.objects.extent(1),
                trial.objects.row(first).begin());
    const double found = sweep.cost(trial, first, size, cost, kShortcutPatience);
    if (!(found < (1.0 - 1e-9) * cost)) continue;
    for (std::size_t n = from + 1; n < end; ++n) {
      path.poses[n] = trial.poses[n];
      path.curvatures[n] = trial.curvatures[n];
      path.lengths[n] = trial.lengths[n];
      path.works[n] = trial.works[n];
      const auto row = static_cast<Index>(n);
      std::copy_n(trial.objects.row(row).begin(), path.objects.extent(1),
                  path.objects.row(row).begin());
    }
    cost = found;
    count = size;
  }
  return {count, cost};
}

}  // namespace pushplan
