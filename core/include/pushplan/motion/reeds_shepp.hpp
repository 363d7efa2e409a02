// The shortest paths of bounded curvature that may reverse (Reeds and Shepp 1990).
#pragma once

#include <array>

#include "pushplan/motion/dubins.hpp"

namespace pushplan {

/// A curve of at most five arcs; those that it does not need have no length.
struct ShortestCurve {
  std::array<Arc, 5> arcs{};
  double length = 0.0;  // of all arcs, ahead and back alike [m]
};

/// The shortest path between two poses under a least turning radius [m] that may lead back.
ShortestCurve reeds_shepp(const Pose& start, const Pose& end, double radius);

/// The same of a robot that may reverse or not: then it is a Dubins path.
ShortestCurve shortest_curve(const Pose& start, const Pose& end, double radius, bool reverses);

}  // namespace pushplan
