// Cost of the rest of the path if no floe moved: a table that guides the search.
//
// The table holds, for the ship's place and heading, the least of travel plus weighted work on a
// grid, by dynamic programming from the goal line backwards. The work of a metre is taken from the
// floes as they lie: each counts with its mass times 1 - d^2 / R^2, d being the distance of the bow
// from its centre and R their two half widths (after the collision cost of AUTO-IceNav, arXiv
// 2411.17155), and more than in proportion where floes crowd: twice as much where as much mass as
// that of the typical floe lies ahead. All of it happens in a frame whose y axis points ahead.
#pragma once

#include <numbers>
#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Greatest angle between the ship and the direction ahead in the table [rad].
inline constexpr double kSteepest = 80.0 * (std::numbers::pi / 180.0);

/// K floes, and what their work depends on.
struct FloeMasses {
  std::span<const Pose> poses;
  std::span<const double> radii;   // of discs with their areas [m]
  std::span<const double> masses;  // [kg]
  double half_beam;                // of the ship [m]
};

/// Costs to go, and what they were made from, in memory of somebody else.
struct IceCostToGo {
  ArrayView<double, 3> table;  // (rows, columns, headings) cost to the goal line [kg m]
  ArrayView<double, 2> field;  // mass ahead of the bow [kg], on smaller cells
  double left;                 // x of the first column of both [m]
  double low;                  // y of the first row of both [m]
  double column;               // distance between the columns of the table [m]
  double row;                  // distance between the rows of the table [m]
  double cell;                 // distance between the rows and the columns of the field [m]
  double bow;                  // distance ahead of the ship's origin at which its bow meets ice [m]
  double mass;                 // of the ship [kg]
  double weight;               // w, cost of work against travel
  double radius;               // least turning radius [m]

  /// Fills the field, the mass ahead of a bow at each place.
  void fill_field(const FloeMasses& floes) const;
  /// Fills the table from the field, from the last row (the goal line) backwards.
  void fill_table() const;

  /// Mass ahead of a ship at a pose [kg]: work of a metre, if no floe had moved before.
  double mass_ahead(const Pose& ship) const;
  /// Estimated cost from a pose to the goal line [kg m].
  double cost_to_go(const Pose& ship) const;
  /// y of the goal line [m].
  double goal() const { return low + static_cast<double>(table.extent(0) - 1) * row; }
};

}  // namespace pushplan
