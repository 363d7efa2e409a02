// Weights of a grid on which a coarse path trades length against pushing.
#pragma once

#include <span>

#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Cells from a first row and column to a last one; they may lie outside of the grid.
struct CellBox {
  Index first_column;
  Index first_row;
  Index last_column;
  Index last_row;
};

/// What a polygon adds to the cost of the cells around it.
struct Surcharge {
  std::span<const double> reach;   // (K,) distance at which it has faded to 0 [m]
  std::span<const double> weight;  // (K,) extra cost per metre at the polygon
};

/// Adds what polygons add to the cost per metre of each cell. `within` are the cells that each polygon reaches.
void add_cell_weights(ArrayView<double, 2> extra, const Cells& cells, const Polygons& polygons,
                       std::span<const CellBox> within, const Surcharge& surcharge);

}  // namespace pushplan
