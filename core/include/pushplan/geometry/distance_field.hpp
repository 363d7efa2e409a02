// Distances at the centres of the cells of a grid: to obstacles, and to a goal around them.
#pragma once

#include <span>

#include "pushplan/array.hpp"
#include "pushplan/geometry/obstacles.hpp"
#include "pushplan/geometry/visibility.hpp"

namespace pushplan {

/// Square cells; row i runs along y, column j along x. The centre of cell (i, j) is at
/// `origin + ((j + 0.5), (i + 0.5)) * step`.
struct Cells {
  Vec2 origin;  // corner with the least x and y [m]
  double step;  // side of a cell [m]

  Vec2 centre(Index i, Index j) const {
    return {origin.x + (static_cast<double>(j) + 0.5) * step,
            origin.y + (static_cast<double>(i) + 0.5) * step};
  }
};

/// Writes the distance [m] to the nearest obstacle for the cells `first` to `last - 1`, counted row
/// by row.
void fill_clearance(ArrayView<double, 2> out, Index first, Index last, const Cells& cells,
                    const Obstacles& obstacles);

/// Writes the distance [m] to the goal of a scene; infinite where there is no way.
void fill_distances(ArrayView<double, 2> out, const Cells& cells, const Nodes& nodes,
                    const GoalScene& scene,
                    double sliver);  // a place this close to an obstacle may be inside of the
                                     // outline around it [m]

/// Reads a distance field at a point: bilinear, but never across a wall. Points outside the grid
/// read its nearest cell. Infinite where there is no way.
///
/// A distance to a goal changes by at most the step between free neighbours; where the four cells
/// around the point differ by more, or one is not finite, a wall lies between them and the cell
/// that holds the point counts alone, or if it has no value the least of the others.
double sample(ArrayView<const double, 2> values, const Cells& cells, Vec2 p);
/// Reads it at many points.
void sample(ArrayView<const double, 2> values, const Cells& cells, std::span<const Vec2> points,
            std::span<double> out);

/// Writes row and column of the marked cell nearest to each cell; -1 where none is marked.
///
/// Maurer, Qi, Raghavan, "A linear time algorithm for computing exact Euclidean distance transforms
/// of binary images in arbitrary dimensions", 2003. Of two equally near the first along the row
/// counts, then the first along the column.
void find_nearest_marked(ArrayView<const bool, 2> marked, ArrayView<Index, 2> rows,
                         ArrayView<Index, 2> cols);

}  // namespace pushplan
