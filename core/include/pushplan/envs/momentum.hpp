// Velocity that moving bodies keep while nothing pushes them, in the plane.
#pragma once

#include <span>

#include "pushplan/array.hpp"

namespace pushplan {

struct Twist {
  double vx;     // [m/s]
  double vy;     // [m/s]
  double omega;  // [rad/s]
};

/// Coefficients of v' = -(b + c |v|) v, which is the drag over the inertia.
struct Drag {
  double linear;     // b [1/s]
  double quadratic;  // c [1/m], or 1 about the vertical axis
};

struct BodyDrag {
  Drag translation;
  Drag rotation;
};

/// Solves v' = -(b + c |v|) v over `h` [s] for the translation and the rotation of each body. A
/// body that keeps nothing stands still then.
void slow_down(std::span<const Twist> velocities, std::span<const double> keeps,  // 0 or 1
               std::span<const BodyDrag> drag, double h, std::span<Twist> out);

}  // namespace pushplan
