// Geometry of tracking: places and errors on a path, and the arc of a constant twist.
#pragma once

#include <cmath>
#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan::mpc {

struct Twist {
  double v;  // forward speed [m/s]
  double w;  // turn rate [rad/s]
};

/// A path as controllers read it; M poses.
struct ReferencePath {
  std::span<const Pose> poses;
  std::span<const double> lengths;  // path length from the first pose [m]
  std::span<const double> speeds;   // forward speed from each pose on [m/s]
  /// Heading to which the robot turns on the spot at the end [rad], if any.
  double last_heading = std::numeric_limits<double>::quiet_NaN();

  double length() const { return lengths.back(); }
};

struct PathPlace {
  double along;     // path length [m]
  Index index;      // number of the segment
  double fraction;  // of the segment
};

/// The place nearest to a point between two path lengths [m]. Past the last pose the path goes on
/// straight.
PathPlace locate(const ReferencePath& track, Vec2 point, double low, double high);

struct PathErrors {
  double offset;     // [m], left positive
  double error;      // of the heading [rad]
  double heading;    // of the path [rad]
  double curvature;  // of the path [1/m]
};

/// Errors at a place. Between two poses the path is the arc that their headings ask for, not its
/// chord.
PathErrors errors(const ReferencePath& track, const Pose& pose, const PathPlace& place);

/// The motion under a constant twist, and its derivatives.
struct ArcMotion {
  Pose end;
  Vec2 by;        // displacement [m]
  Vec2 by_turn;   // d(x, y)/dw
  Vec2 by_speed;  // d(x, y)/dv
};

inline ArcMotion arc(const Pose& from, const Twist& twist, double dt) {
  const double half = 0.5 * twist.w * dt;
  double sinc = 1.0 - half * half / 6.0;
  double slope = -half / 3.0;
  if (std::abs(half) > 1e-4) {
    sinc = std::sin(half) / half;
    slope = (std::cos(half) * half - std::sin(half)) / (half * half);
  }
  const double c = std::cos(from.theta + half);
  const double s = std::sin(from.theta + half);
  const double chord = twist.v * dt * sinc;
  const double rate = twist.v * dt * slope * 0.5 * dt;
  const Vec2 by{chord * c, chord * s};
  return {{from.x + by.x, from.y + by.y, from.theta + twist.w * dt},
          by,
          {rate * c - chord * s * 0.5 * dt, rate * s + chord * c * 0.5 * dt},
          {dt * sinc * c, dt * sinc * s}};
}

}  // namespace pushplan::mpc
