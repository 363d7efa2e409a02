// The cost of what is covered from each place of a lattice to a goal line.
//
// A path crosses every row of cells up to the line, and where its origin does so, the robot covers
// at least a window as wide as its inscribed disc. So the cost is at least that of the best
// sequence of such windows, one in each row, plus the length of the path that joins them. Of that
// length only a cos(lean) + b sin(lean) counts, for a metres ahead and b across, which is never
// more than it: rounding the crossings to cells lengthens b no further if they may be off by one
// cell.
//
// That bound dodges floes as no hull can. Averaging the costs along the path over the length of the
// hull takes this out: an estimate that is no bound, but guides a search much better.
#pragma once

#include <span>

#include "pushplan/array.hpp"

namespace pushplan {

/// Cells that a robot is assumed to cover where it crosses a row of cells.
struct HullWindow {
  Index half;     // cells to each side of the one below its origin
  Index reach;    // distance ahead of the origin in which it may cover cells already [cells]
  Index along;    // rows to each side over which costs are averaged; 0 for a bound
  Index stage;    // rows from one that is looked at to the next; 1 for a bound
  double factor;  // factor on costs; at most 1 for a bound
  double cell;    // side of a cell [m]
  double lean;    // [rad]
};

/// Places of a lattice on a map.
struct LatticePlaces {
  std::span<const Index> rows;     // (U,) row of the map on which each row of the lattice lies
  std::span<const Index> columns;  // (V,) columns of the map on which those of the lattice lie
  Index goal_row;                  // row of the map on which the goal line lies, or one before
  Index first;                     // first and last column of the map where the origin may be
  Index last;
};

/// Fills `costs`, (U, V), with the cost [m] from each place to the goal line, at least or about; 0
/// beyond it. `sums` is (map columns, map rows + 1), costs of each column before each row [m].
void place_costs(ArrayView<const double, 2> sums, const LatticePlaces& places,
                 const HullWindow& window, ArrayView<double, 2> costs);

}  // namespace pushplan
