// A lower bound on the cost of plans, from the length of their paths alone.
#pragma once

#include <optional>

#include "pushplan/geometry/shortest_path.hpp"

namespace pushplan {

/// A cost that no plan can undercut. Every path is at least as long as the shortest one of the
/// robot's inscribed disc around the walls, and as the shortest one under its turning radius
/// without walls; objects only add to that. The former counts as nothing where the robot starts too
/// near to a wall, or obstacles have more than `ShortestPath::kSomeCorners` corners.
class LengthBound {
 public:
  /// Fraction by which the disc is less than the inscribed one: gaps as wide as the robot count.
  static constexpr double kSlim = 1e-3;

  /// The map has to outlive it.
  LengthBound(const StaticMap& map,  // that the robot keeps out of
              const Pose& start, const GoalRegion& goal,
              double mass,              // of the robot [kg]
              double inscribed_radius,  // of the robot [m]
              double turning_radius);   // [m]; 0 for a robot that may turn on the spot, or go back

  /// Goes on for about half a millisecond; true when all of the bound is known.
  bool run();
  /// The bound as far as it is known [kg m].
  double cost() const { return mass_ * length_; }

 private:
  double mass_;
  double length_;  // [m]
  std::optional<ShortestPath> path_;
};

}  // namespace pushplan
