// Swaths: the cells of a map that a moving footprint newly covers, as runs in columns.
#pragma once

#include <span>
#include <vector>

#include "pushplan/motion/dubins.hpp"

namespace pushplan {

/// Cells of one column, relative to the cell of the start.
struct ColumnRun {
  Index column;
  Index first_row;
  Index end_row;  // last row + 1
};

/// Finds the cells that a footprint newly covers on its path from the cell (0, 0), whose centre is
/// at the robot's origin. Lengths in cells.
std::vector<ColumnRun> sweep_cells(double heading,  // at the start [rad]
                                   std::span<const Arc> arcs,
                                   const Polygons& footprint,  // convex parts in the body frame
                                   double reach,     // of the disc about the origin that holds it
                                   double spacing);  // of the poses that are looked at

}  // namespace pushplan
