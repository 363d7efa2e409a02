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

/// Marks which of the cells from `first` to `last` (exclusive), counted row by row, hold the
/// footprint. `free` is (rows, columns, headings).
void mark_free(ArrayView<bool, 3> free, Index first, Index last, const Cells& cells,
               const Footprint& footprint, const ConvexObstacles& walls);

/// Grid lengths to a goal.
struct Flood {
  std::vector<double> lengths;  // of each cell, row by row [m]
  std::vector<Index> order;     // the cells in the order of their lengths
};

/// Floods the open cells, (rows, columns), from a goal. `centre` is the cell of the goal's middle,
/// negative for none: a disc may be smaller than a cell.
Flood flood(ArrayView<const bool, 2> open, const Cells& cells, const GoalRegion& goal,
            Index centre);

/// Where short arcs lead to from each heading of a table.
struct ArcEnds {
  ArrayView<const Pose, 2> ends;  // (headings, arcs) displacement, and heading at the end
  double length;                  // of the arcs [m]
};

/// One Gauss-Seidel sweep over the cells in some order, by their distances from the goal. `values`
/// are those of the table. Returns the greatest change [m].
double sweep_cost_to_go(ArrayView<double, 3> values, const CostToGo& table,
                        ArrayView<const bool, 3> free, std::span<const Index> order,
                        const ArcEnds& arcs);

}  // namespace pushplan
