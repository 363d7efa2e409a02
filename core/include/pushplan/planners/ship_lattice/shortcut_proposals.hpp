// Random changes of a path that keep it drivable: Dubins curves through displaced poses.
//
// Shortcutting after Geraerts and Overmars, "Creating high-quality paths for motion planning"
// (2007).
#pragma once

#include "pushplan/motion/shortcut.hpp"

namespace pushplan {

/// The line where a path ends.
struct GoalLine {
  Vec2 point;   // [m]
  Vec2 normal;  // unit
};

/// Constraints on a changed path, and the scale of its changes.
struct ChangeProblem {
  DubinsLimits limits;
  double spread;        // typical sideways displacement [m]
  double end_fraction;  // fraction of the changes that are changes of the end
  GoalLine goal;
};

/// Random numbers of one change, uniform in [0, 1).
struct ChangeDraw {
  double span;
  double place;
  double kind;
  double scale;
};

/// Further ones, standard normal.
struct ChangeShift {
  double sideways;
  double turn;
};

/// A changed path, of no poses if there is none.
struct ChangedPath {
  Index first;  // last pose shared with the old path
  Index rest;   // first pose of the old path's rest
  Index size;   // number of poses
};

/// Changes a path at random.
ChangedPath propose_change(const Path& path, const ChangeDraw& draw, const ChangeShift& shift,
                           const ChangeProblem& problem, const PathBuffer& out);

}  // namespace pushplan
