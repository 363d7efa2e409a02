// The goal of a robot: a disc, in which it may have to face a heading, or everything beyond a line.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

struct GoalRegion {
  enum class Kind { kDisc, kLine };

  Kind kind;
  Vec2 point;           // centre of the disc, or a point of the line [m]
  Vec2 normal{};        // of a line, unit, towards the goal
  double radius = 0.0;  // of a disc [m]
  double heading = std::numeric_limits<double>::quiet_NaN();  // to face in a disc [rad], if any
  bool turns = false;               // paths turn to it on the spot; else they curve into it
  double heading_tolerance = 0.05;  // to either side [rad]

  bool has_heading() const { return !std::isnan(heading); }

  bool contains(Vec2 p) const {
    const double dx = p.x - point.x;
    const double dy = p.y - point.y;
    if (kind == Kind::kDisc) return dx * dx + dy * dy <= radius * radius;
    return dx * normal.x + dy * normal.y >= 0.0;
  }

  /// True if a robot at a pose is there, and faces the heading if there is one.
  bool reached_by(const Pose& pose) const {
    const double error = has_heading() ? wrap_angle(heading - pose.theta) : 0.0;
    return contains({pose.x, pose.y}) && std::abs(error) <= heading_tolerance;
  }

  /// Distance [m] from a point; 0 inside.
  double distance(Vec2 p) const {
    const double dx = p.x - point.x;
    const double dy = p.y - point.y;
    const double gap = kind == Kind::kDisc ? std::sqrt(dx * dx + dy * dy) - radius
                                           : -(dx * normal.x + dy * normal.y);
    return std::max(gap, 0.0);
  }

  /// True for a disc of which no point lies in a box.
  bool is_outside(const Box& box) const {
    const Vec2 nearest{std::min(std::max(point.x, box.x_min), box.x_max),
                       std::min(std::max(point.y, box.y_min), box.y_max)};
    return kind == Kind::kDisc && distance(nearest) > 0.0;
  }
};

}  // namespace pushplan
