// A laser scan, marked in a grid of log-odds.
#pragma once

#include <span>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// Cells of a map: row i lies along y, column j along x, from the corner of cell (0, 0).
struct LogOdds {
  ArrayView<double, 2> values;  // 0 where nobody has looked, never again once somebody has
  Vec2 corner;                  // [m]
  double side;                  // of a cell [m]
};

/// What a scan changes.
struct ScanEvidence {
  double hit;     // added to the cell in which a beam ends
  double miss;    // added to every cell that a beam has passed, and in or beside which none ends
  double lowest;  // least log-odds of a cell
  double highest;
  bool averaged;  // a cell gets the mean of its beams: for noise that spreads over several cells
};

/// Cells from the first up to, not including, the last.
struct CellWindow {
  Index row;
  Index column;
  Index end_row;
  Index end_column;
};

/// Marks beams from a point; a scan changes a cell once. A beam is free up to `passed` [m]; it ends
/// in a cell at `hits` [m], unless that is infinite. Bearings are those of the world.
/// Returns the cells that may have changed.
CellWindow mark_scan(const LogOdds& map, const Vec2& from, std::span<const double> bearings,
                     std::span<const double> passed, std::span<const double> hits,
                     const ScanEvidence& evidence);

}  // namespace pushplan
