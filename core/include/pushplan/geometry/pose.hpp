// Points, poses and outlines in the plane. Lengths in m, angles in rad.
#pragma once

#include <cmath>
#include <numbers>
#include <span>

#include "pushplan/array.hpp"

namespace pushplan {

struct Vec2 {
  double x;
  double y;
};

struct Pose {
  double x;
  double y;
  double theta;

  bool operator==(const Pose&) const = default;
};

/// Corners of a convex polygon, counter-clockwise.
using Polygon = std::span<const Vec2>;

/// Polygons one after the other: number i has the vertices `offsets[i]` to `offsets[i + 1] - 1`.
struct Polygons {
  std::span<const Vec2> vertices;
  std::span<const Index> offsets;

  Index count() const { return static_cast<Index>(offsets.size()) - 1; }
  Polygon operator[](Index i) const {
    const auto k = static_cast<std::size_t>(i);
    return vertices.subspan(static_cast<std::size_t>(offsets[k]),
                            static_cast<std::size_t>(offsets[k + 1] - offsets[k]));
  }
};

/// The equivalent angle in [-pi, pi]; half a turn keeps the sign that rounding to even gives it.
inline double wrap_angle(double angle) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return angle - kTurn * std::rint(angle / kTurn);
}

/// Carries points from the frame of a body to the world. `out` may be the points themselves.
inline void transform(const Pose& pose, std::span<const Vec2> points, Vec2* out) {
  const double c = std::cos(pose.theta);
  const double s = std::sin(pose.theta);
  for (const Vec2 p : points) {
    *out++ = {pose.x + c * p.x - s * p.y, pose.y + s * p.x + c * p.y};
  }
}

}  // namespace pushplan
