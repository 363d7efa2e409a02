// What searches know of a problem, and of a path.
#pragma once

#include <cmath>
#include <span>

#include "pushplan/array.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/dubins.hpp"
#include "pushplan/motion/goal_region.hpp"

namespace pushplan {

/// Prices of places in square cells: a metre where the price is p costs as much as 1 + p elsewhere.
struct PriceGrid {
  ArrayView<const double, 2> prices;  // (rows, columns), row 0 at the least y of the grid
  Pose origin{};                      // of the outer corner of cell (0, 0), world frame
  double cell = 1.0;                  // side [m]

  /// What a metre costs at a point of the world; 1 outside of the grid.
  double factor(Vec2 p) const {
    if (prices.size() == 0) return 1.0;
    const double dx = p.x - origin.x;
    const double dy = p.y - origin.y;
    const double c = std::cos(origin.theta);
    const double s = std::sin(origin.theta);
    const auto column = static_cast<Index>(std::floor((c * dx + s * dy) / cell));
    const auto row = static_cast<Index>(std::floor((c * dy - s * dx) / cell));
    if (row < 0 || row >= prices.extent(0)) return 1.0;
    if (column < 0 || column >= prices.extent(1)) return 1.0;
    return 1.0 + prices(row, column);
  }
};

/// The motion by which shortcuts lead from pose to pose.
enum class Connection {
  kDubins,      // arcs ahead
  kReedsShepp,  // arcs ahead and back
  kStraight     // straight in any direction, turning at an even rate
};

/// Costs and constraints of a path.
struct PathProblem {
  double robot_mass;      // m0 [kg]
  double push_weight;     // w: weight of a unit of interaction work
  double turning_radius;  // least one [m]
  double spacing;         // greatest distance between two poses of a path [m]
  double jam_length;      // added to a path's length at each pose where the robot jams [m], to tell
                          // it from any other
  double displacement;    // typical sideways displacement that shortcutting tries [m]
  GoalRegion goal;
  Footprint footprint;  // with its margin
  ConvexObstacles walls;
  Connection connection = Connection::kDubins;
  PriceGrid price{};
};

}  // namespace pushplan
