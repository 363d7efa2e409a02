// A map of what it costs to cover each cell, and how outlines are put on it.
//
// Maps are (rows, columns), and places on them are points whose x is the row and whose y is the
// column, in cells; whole numbers are the centres of cells.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Places on a map.
struct CellSpan {
  double low;
  double high;
};

/// Least and greatest column of a convex outline in a row; from infinity to minus infinity where
/// there is none.
CellSpan row_span(Polygon outline, double row);

/// Costs of covering K floes. The cost of a floe is spread over its cells in proportion to
/// (1 + soft - q^2)^exponent, where q is the distance from its centre over the radius of the disc
/// of the same area, at most 1. An exponent of -1/2 makes every strip of a disc, of whatever
/// direction, cost the same; 1 weighs the middle most.
struct FloeCosts {
  std::span<const double> totals;  // (K,) of covering the whole floe, in metres of travel
  double exponent;
  double soft;  // positive where the exponent is negative
};

/// K floes as they lie on a map [cells].
struct PlacedFloes {
  Polygons outlines;
  std::span<const Vec2> centres;  // (K,)
  std::span<const double> radii;  // (K,) of the disc of the same area
  FloeCosts costs;
};

/// Adds the cost of each floe to the cells whose centres it covers.
void add_floes(const PlacedFloes& floes, ArrayView<double, 2> grid);

/// Sets every cell to 1 that lies within `margin` [cells] of one of some convex outlines,
/// counter-clockwise. A margin of at least half the diagonal of a cell misses no overlap.
void block_cells(const Polygons& outlines, double margin, ArrayView<double, 2> grid);

/// Fills `sums`, (columns, rows + 1), with the sums of each column of a grid before each row.
void prefix_sums(ArrayView<const double, 2> grid, ArrayView<double, 2> sums);

}  // namespace pushplan
