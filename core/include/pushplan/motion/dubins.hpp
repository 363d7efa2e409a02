// Arcs, and the shortest forward paths of bounded curvature (Dubins 1957).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// An arc. A turn on the spot is one of infinite curvature, whose length is its angle [rad].
struct Arc {
  double length;     // [m], negative for back
  double curvature;  // [1/m], positive to the left
};

/// The poses of a path and the curvature that leads to each [1/m]; as many of one as of the other.
struct Path {
  std::span<const Pose> poses;
  std::span<const double> curvatures;

  Index size() const { return static_cast<Index>(poses.size()); }
};

/// The same to write to; it may be longer than what is written.
struct PathBuffer {
  std::span<Pose> poses;
  std::span<double> curvatures;

  Index size() const { return static_cast<Index>(poses.size()); }
  PathBuffer from(Index i) const {
    const auto skip = static_cast<std::size_t>(i);
    return {poses.subspan(skip), curvatures.subspan(skip)};
  }
};

struct DubinsPath {
  std::array<Arc, 3> arcs{};
  double length = 0.0;  // [m]

  /// Turn of all arcs, left and right alike [rad].
  double turn() const {
    double total = 0.0;
    for (const Arc& arc : arcs) total += std::abs(arc.length * arc.curvature);
    return total;
  }
};

/// Greatest change of heading between two poses of a path [rad].
inline constexpr double kMaxTurn = 0.15;

/// The shortest forward path between two poses under a least turning radius [m]. The six words are
/// solved as in Shkel and Lumelsky, "Classification of the Dubins set" (2001), with the start at
/// the origin and lengths in units of the radius.
DubinsPath dubins(const Pose& start, const Pose& end, double radius);

/// The pose at the end of an arc.
inline Pose along_arc(const Pose& start, const Arc& arc) {
  if (std::isinf(arc.curvature)) {
    return {start.x, start.y, start.theta + arc.length * (arc.curvature > 0.0 ? 1.0 : -1.0)};
  }
  const double turn = arc.length * arc.curvature;
  const double half = 0.5 * turn;
  // chord of the arc; sin(x) / x keeps the straight limit exact
  const double chord = std::abs(half) < 1e-9 ? arc.length : arc.length * std::sin(half) / half;
  const double heading = start.theta + half;
  return {start.x + chord * std::cos(heading), start.y + chord * std::sin(heading),
          start.theta + turn};
}

/// Distance between poses on an arc [m]: `spacing`, less where that would turn too far.
inline double step_along(double curvature, double spacing) {
  if (std::isinf(curvature)) return kMaxTurn;
  return std::min(spacing, kMaxTurn / std::max(std::abs(curvature), 1e-12));
}

/// Lays poses along arcs, without the start itself, at most `spacing` [m] apart, less in tight
/// turns. Returns their number, or -1 if `out` is too short.
Index sample_arcs(const Pose& start, std::span<const Arc> arcs, double spacing,
                  const PathBuffer& out);

}  // namespace pushplan
