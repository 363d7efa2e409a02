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

/// Writes a candidate for a path into `trial`, of the same capacity, without the objects.
ShortcutProposal propose_shortcut(const SweptPath& path, const ShortcutDraw& draw,
                                  const ShortcutShift& shift, const PathProblem& problem,
                                  SweptPath& trial);

/// Pairs of objects that may be tested for one shortcut; that takes some milliseconds.
inline constexpr Index kShortcutPatience = 1'500;

/// Tries a shortcut of a path of some cost, in place. Returns the cost of the path then.
template <InteractionModel M>
double shortcut(SweptPath& path, double cost, const ShortcutDraw& draw, const ShortcutShift& shift,
                SweptPath& trial, const PathProblem& problem, M& model) {
  if (path.count < 4) return cost;
  const auto [first, added, size] = propose_shortcut(path, draw, shift, problem, trial);
  if (size == 0) return cost;
  trial.count = size;
  trial.begin_at(first, path);
  // no sweep can make up for a path that is too long by itself
  const auto from = static_cast<std::size_t>(first);
  double length = path.lengths[from];
  for (std::size_t n = from + 1; n < trial.used().size(); ++n) {
    const double dx = trial.poses[n].x - trial.poses[n - 1].x;
    const double dy = trial.poses[n].y - trial.poses[n - 1].y;
    length += std::sqrt(dx * dx + dy * dy);
  }
  if (problem.robot_mass * length + problem.push_weight * path.works[from] >= cost) return cost;
  CollisionChecker checker(problem.footprint, problem.walls);
  const auto fresh = trial.used().subspan(from + 1, static_cast<std::size_t>(added));
  if (checker.first_blocked(fresh) < added) return cost;
  const double found = sweep_objects(trial, first, size, cost, kShortcutPatience, problem, model);
  if (!(found < (1.0 - 1e-9) * cost)) return cost;
  path.take(trial, first);
  return found;
}

}  // namespace pushplan
