// Velocity that moving bodies keep while nothing pushes them, in the plane.
#pragma once

#include <span>

#include "pushplan/array.hpp"

namespace pushplan {

struct Twist {
  double vx;     // [m/s]
  double vy;     // [m/s]
  double omega;  // [rad/s]

  bool operator==(const Twist&) const = default;
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

struct Inertia {
  double mass;    // [kg]
  double moment;  // of inertia [kg m^2]
};

/// Drag on the N bodies of a scene; those on dry ground keep nothing of their velocity.
struct Momentum {
  std::span<const double> keeps;  // 1 if a body keeps anything, else 0
  std::span<const Inertia> inertia;
  std::span<const BodyDrag> drag;

  /// Velocity of body `i` after `h` [s] without contact: solves v' = -(b + c |v|) v for its
  /// translation and its rotation. A body that keeps nothing stands still then.
  Twist after(Index i, const Twist& velocity, double h) const;

  /// Rate [1/s] at which body `i` loses speed by itself; 0 if it stands still or keeps nothing.
  double decay(Index i, const Twist& velocity) const;
};

}  // namespace pushplan
