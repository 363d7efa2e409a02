// Least driven length to the goal from every pose, around walls and under the turn limit.
//
// The value function of a forward car of bounded curvature on a grid of (x, y, heading), solved by
// semi-Lagrangian Gauss-Seidel sweeps: from each cell centre short arcs are driven, and the value
// where they end is interpolated (Falcone and Ferretti, "Semi-Lagrangian Approximation Schemes for
// Linear and Hamilton-Jacobi Equations", 2013; for cars: Takei, Tsai, Shen and Landa, "A practical
// path-planning algorithm for a simple car", 2010). Objects are not in it, so one table serves
// every call on a map.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/goal_region.hpp"
#include "pushplan/zeroed_array.hpp"

namespace pushplan {

/// A table of lengths to the goal.
struct CostToGo {
  ArrayView<const double, 3> values;  // (rows, columns, headings) [m]; infinite where the robot
                                      // overlaps a wall or has no way
  ArrayView<const double, 2> floor;  // (rows, columns) least length for the robot's inscribed disc,
                                     // on the grid [m]
  Cells cells;

  Index rows() const { return values.extent(0); }
  Index columns() const { return values.extent(1); }
  Index headings() const { return values.extent(2); }

  /// The cell that holds a point, or the nearest one.
  Index row_of(double y) const {
    const auto row = static_cast<Index>((y - cells.origin.y) / cells.step);
    return std::min(std::max(row, Index{0}), rows() - 1);
  }
  Index column_of(double x) const {
    const auto column = static_cast<Index>((x - cells.origin.x) / cells.step);
    return std::min(std::max(column, Index{0}), columns() - 1);
  }
  /// The nearest heading of the table.
  Index heading_of(double theta) const;

  /// Length to the goal from a pose [m]: the table's, or its floor where it has none.
  double length_to_go(const Pose& pose) const;
};

/// Makes the table of a robot in small steps, so that a planning call can stop in between. The
/// arrays of the footprint and the walls have to outlive it.
class CostToGoMaker {
 public:
  static constexpr Index kHeadings = 32;

  CostToGoMaker(const Footprint& footprint, const ConvexObstacles& walls, const GoalRegion& goal,
                double size,    // circumscribed radius of the robot [m]
                double radius,  // least turning radius [m]
                Index headings = kHeadings);

  /// True if a table of bearable size resolves the robot.
  bool useful() const { return useful_; }
  /// True if the floor of the table is known.
  bool flooded() const { return marked_ == cell_count(); }
  bool done() const { return done_; }
  /// Goes on for less than two milliseconds.
  void step();
  /// The table with what is done of it.
  CostToGo table() const;

 private:
  Index cell_count() const { return rows_ * columns_; }
  ArrayView<bool, 3> free() const { return {free_.data(), {rows_, columns_, headings_}}; }
  void flood_cells();

  Footprint footprint_;
  ConvexObstacles walls_;
  GoalRegion goal_;
  Cells cells_;
  bool useful_;
  bool done_;
  Index rows_ = 1;
  Index columns_ = 1;
  Index headings_;
  double settled_;              // change of a value below which the table is done [m]
  double length_;               // of the arcs that carry values from cell to cell [m]
  std::vector<Pose> ends_;      // (headings, arcs)
  ZeroedArray<bool> free_;      // (rows, columns, headings)
  std::vector<double> values_;  // the same shape
  std::vector<double> floor_;   // (rows, columns)
  std::vector<Index> order_;    // cells by their distance from the goal
  Index marked_ = 0;            // cells of which it is known where the robot fits
  std::size_t at_ = 0;          // the place in the order
  Index sweeps_ = 0;
  double change_ = 0.0;  // greatest one of this sweep [m]
};

}  // namespace pushplan
