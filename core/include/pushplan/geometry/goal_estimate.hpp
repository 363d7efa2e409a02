// Estimates of the way to a goal, from a chamfer distance over the cells of a map.
//
// A path goes from cell to cell through sides that no obstacle covers. So the distance between two
// cells, by moves to the sixteen cells around through such sides, is about the length of the
// shortest path or less. Moves cost 5, 7 and 11 fifths of a cell (Borgefors 1986, "Distance
// transformations in digital images"), which is at most 1.02 times their length.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pushplan/array.hpp"
#include "pushplan/geometry/regions.hpp"

namespace pushplan {

/// Square cells over a box, and which of the sides between them an obstacle covers.
class CoveredSides {
 public:
  /// Outlines are convex, (C,), as paths go around them [m]. Paths stay in the box.
  CoveredSides(Polygons outlines, const Box& box, double cell);

  Index rows() const { return rows_; }
  Index columns() const { return columns_; }
  double cell() const { return cell_; }  // side of a cell [m]
  /// The cell of a point, the nearest of a point outside.
  Index cell_of(Vec2 p) const;
  Vec2 centre(Index cell) const;  // [m]
  /// True if the side between two neighbouring cells is covered.
  bool covered(Index cell, Index neighbour) const;

 private:
  Vec2 origin_;
  double cell_;
  Index rows_;
  Index columns_;
  std::vector<char> left_;   // (rows * columns,) whether that side of a cell is covered
  std::vector<char> below_;  // and the one towards lower y
};

/// Estimates for paths from places around one start to a goal. The sides have to outlive it.
class GoalEstimate {
 public:
  /// Share by which estimates are drawn out, so that A* looks at far fewer places (Pohl 1970,
  /// "Heuristic search viewed as path finding in a graph"). Its path is longer than the shortest by
  /// that share at most, and by more where the way weaves between things about a cell apart.
  static constexpr double kLonger = 0.05;

  GoalEstimate(const CoveredSides& cells, const Regions& regions, Vec2 start);

  /// The length of the way from a place [m], infinite where there is none.
  double from(Vec2 p) const;

 private:
  const CoveredSides& cells_;
  std::vector<std::int32_t> distances_;  // of the cells [fifths of a cell]
  std::int32_t rest_;                    // of cells that were not reached, at least
};

}  // namespace pushplan
