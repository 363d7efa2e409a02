// A grid over obstacles, so that a line of sight is tested against those near it only.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "pushplan/geometry/obstacles.hpp"

namespace pushplan {

/// The obstacles that reach into each cell.
class ObstacleGrid {
 public:
  /// A range of cells in a row or a column; the last comes before the first where there is none.
  struct Range {
    Index first;
    Index last;
  };

  /// A grid over obstacles grown by `margin` [m]. Their arrays have to outlive it.
  ObstacleGrid(const Obstacles& obstacles, double margin);

  const Obstacles& obstacles() const { return obstacles_; }
  Vec2 origin() const { return origin_; }  // least x and y [m]
  double cell() const { return cell_; }    // side of a cell [m]
  Index rows() const { return rows_; }
  Index columns() const { return columns_; }

  /// The numbers of the obstacles in a cell.
  std::span<const Index> in_cell(Index row, Index column) const {
    const auto at = static_cast<std::size_t>(row * columns_ + column);
    return {items_.data() + first_[at], items_.data() + first_[at + 1]};
  }

  /// The rows and columns that an interval [cells] reaches.
  Range rows_between(double low, double high) const { return between(low, high, rows_); }
  Range columns_between(double low, double high) const { return between(low, high, columns_); }

 private:
  static Range between(double low, double high, Index count);
  void fill(double margin);
  Range rows_of(Index k, Index column, double reach) const;
  template <class Visit>
  void for_each_cell(double margin, Visit visit) const;

  Obstacles obstacles_;
  Vec2 origin_{0.0, 0.0};
  double cell_ = 1.0;
  Index rows_ = 0;
  Index columns_ = 0;
  std::vector<Index> first_;  // (rows * columns + 1,) where the obstacles of each cell start
  std::vector<Index> items_;  // their numbers
};

/// Tests of sight with a grid and memory, for one thread. The grid has to outlive it.
class GridSight {
 public:
  explicit GridSight(const ObstacleGrid& grid);

  /// True if the segment p-q stays at least `margin` [m], at most that of the grid, away from all
  /// obstacles.
  bool sees(Vec2 p, Vec2 q, double margin);

 private:
  const ObstacleGrid& grid_;
  std::vector<Index> tested_;  // (C,) the last call in which each obstacle was tested
  Index calls_ = 0;
};

}  // namespace pushplan
