// Pieces of random path shortcutting with Dubins curves.
#pragma once

#include "pushplan/motion/dubins.hpp"

namespace pushplan {

/// A pose moved to its left by `sideways` [m] and turned by `turn` [rad].
inline Pose displace(const Pose& pose, double sideways, double turn) {
  return {pose.x - sideways * std::sin(pose.theta), pose.y + sideways * std::cos(pose.theta),
          pose.theta + turn};
}

struct DubinsLimits {
  double radius;     // least turning radius [m]
  double spacing;    // greatest distance between two poses [m]
  double most_turn;  // greatest turn in all [rad]
};

/// Copies a path up to its pose `last`. Returns the number of poses.
Index copy_start(const Path& path, Index last, const PathBuffer& out);

/// Lays the Dubins path between two poses, without the start. Returns the number of poses, -1 where
/// the path turns too much or does not fit.
Index lay_dubins(const Pose& start, const Pose& end, const DubinsLimits& limits,
                 const PathBuffer& out);

/// Lays poses straight from one to another, turning the shorter way at an even rate, without the
/// start. Returns the number of poses, -1 where they do not fit.
Index lay_straight(const Pose& start, const Pose& end, double spacing, const PathBuffer& out);

/// Copies a path after its pose `last`, at which a new piece ends that fills the first `size` poses
/// of `out`. Returns the new size.
Index copy_rest(const Path& path, Index last, const PathBuffer& out, Index size);

}  // namespace pushplan
