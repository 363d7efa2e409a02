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
  /// True if one move leads to the neighbour in a direction, of eight from x on to the left.
  bool leads(Index cell, int direction) const {
    return ((moves_[static_cast<std::size_t>(cell)] >> (direction & 7)) & 1) != 0;
  }

 private:
  Vec2 origin_;
  double cell_;
  Index rows_;
  Index columns_;
  std::vector<std::uint8_t> moves_;  // (rows * columns,) a bit for each direction
};

/// Estimates for paths from places around one start to a goal. The sides have to outlive it.
class GoalEstimate {
 public:
  /// Share by which estimates are drawn out, so that A* looks at far fewer places (Pohl 1970,
  /// "Heuristic search viewed as path finding in a graph"). Its path is longer than the shortest by
  /// that share at most, and by more where the way weaves between things about a cell apart.
  static constexpr double kLonger = 0.05;

  GoalEstimate(const CoveredSides& cells, const Regions& regions, Vec2 start);

  /// Looks at so many cells more, by A* from the goal towards the start; true when all is known.
  bool run(Index cells);
  /// The length of the way from a place [m], infinite where there is none.
  double from(Vec2 p) const;

 private:
  std::int32_t to_start(Index cell) const;  // free distance [fifths of a cell]
  void spread(Index cell);                  // makes known what moves from it lead to

  const CoveredSides& cells_;
  Index wanted_;                             // the start's cell
  std::vector<std::int32_t> distances_;      // of the cells to the goal [fifths of a cell]
  std::vector<Index> goals_;                 // cells of the goal, the farthest from the start first
  std::vector<std::vector<Index>> buckets_;  // cells by the length of a way through them
  std::int32_t now_ = 0;                     // the least such length
  std::int32_t empty_;                       // buckets in a row
  std::int32_t end_;                         // lengths beyond which nothing matters
  std::int32_t rest_;                        // lengths through cells that are not known, at least
};

}  // namespace pushplan
