// Points, poses and outlines in the plane. Lengths in m, angles in rad.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "pushplan/arithmetic.hpp"
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

inline bool is_finite(const Pose& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.theta);
}

struct Segment {
  Vec2 from;
  Vec2 to;
};

struct Box {
  double x_min;
  double y_min;
  double x_max;
  double y_max;

  /// True if a point lies in the box grown by a margin on every side; its outline counts.
  bool contains(Vec2 p, double margin) const {
    return x_min - margin <= p.x && p.x <= x_max + margin && y_min - margin <= p.y &&
           p.y <= y_max + margin;
  }
  /// True if it is more than a margin away from another one along an axis.
  bool apart(const Box& other, double margin) const {
    return other.x_min - x_max > margin || x_min - other.x_max > margin ||
           other.y_min - y_max > margin || y_min - other.y_max > margin;
  }
};

/// Corners of a convex polygon, counter-clockwise.
using Polygon = std::span<const Vec2>;

/// The number of the corner after corner `i`.
inline std::size_t next_corner(Polygon polygon, std::size_t i) {
  return i + 1 < polygon.size() ? i + 1 : 0;
}

/// The box around a polygon.
inline Box box_around(Polygon polygon) {
  Box box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (const Vec2 p : polygon) {
    box = {std::min(box.x_min, p.x), std::min(box.y_min, p.y), std::max(box.x_max, p.x),
           std::max(box.y_max, p.y)};
  }
  return box;
}

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

/// K bodies, each the union of convex parts.
struct Compounds {
  Polygons parts;                // in the frames of their bodies
  std::span<const Index> first;  // (K + 1,) number of the first part of each body, then of all

  Index count() const { return static_cast<Index>(first.size()) - 1; }
  Index begin(Index k) const { return first[static_cast<std::size_t>(k)]; }
  Index end(Index k) const { return first[static_cast<std::size_t>(k) + 1]; }
  /// Where the corners of body k are in `parts.vertices`: the first, and how many.
  std::pair<std::size_t, std::size_t> corners(Index k) const {
    const Index from = parts.offsets[static_cast<std::size_t>(begin(k))];
    const Index to = parts.offsets[static_cast<std::size_t>(end(k))];
    return {static_cast<std::size_t>(from), static_cast<std::size_t>(to - from)};
  }
};

/// The equivalent angle in [-pi, pi]; half a turn keeps the sign that rounding to even gives it.
inline double wrap_angle(double angle) { return angle - kTurn * std::rint(angle / kTurn); }

/// The equivalent angle in [-pi, pi); in its last bits it may differ from `wrap_angle`.
inline double wrap_below_pi(double angle) {
  return floor_mod(angle + std::numbers::pi, 2.0 * std::numbers::pi) - std::numbers::pi;
}

/// Carries points from the frame of a body to the world. `out` may be the points themselves.
inline void transform(const Pose& pose, std::span<const Vec2> points, Vec2* out) {
  const double c = std::cos(pose.theta);
  const double s = std::sin(pose.theta);
  for (const Vec2 p : points) {
    *out++ = {pose.x + c * p.x - s * p.y, pose.y + s * p.x + c * p.y};
  }
}

/// Carries the outlines of several bodies to the world, each from its own frame. `out` receives as
/// many points as there are vertices.
inline void transform(std::span<const Pose> poses, const Polygons& outlines, Vec2* out) {
  for (std::size_t k = 0; k < poses.size(); ++k) {
    transform(poses[k], outlines[static_cast<Index>(k)], out + outlines.offsets[k]);
  }
}

/// The pose that a step [m] with a turn [rad] leads to: along the chord of the arc.
inline Pose arc_step(const Pose& pose, double distance, double turn) {
  const double heading = pose.theta + 0.5 * turn;
  return {pose.x + distance * std::cos(heading), pose.y + distance * std::sin(heading),
          pose.theta + turn};
}

}  // namespace pushplan
