#include "pushplan/geometry/obstacle_grid.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

constexpr Index kCellsPerObstacle = 4;
constexpr Index kMaxCells = 65'536;
constexpr double kRounding = 1e-6;  // it may put a point into the next cell [cells]

}  // namespace

ObstacleGrid::ObstacleGrid(const Obstacles& obstacles, double margin) : obstacles_(obstacles) {
  if (obstacles.boxes.empty()) {
    first_.resize(1);
    return;
  }
  Box around = obstacles.boxes[0];
  for (const Box& box : obstacles.boxes) {
    around.x_min = std::min(around.x_min, box.x_min);
    around.y_min = std::min(around.y_min, box.y_min);
    around.x_max = std::max(around.x_max, box.x_max);
    around.y_max = std::max(around.y_max, box.y_max);
  }
  origin_ = {around.x_min - margin, around.y_min - margin};
  double width = around.x_max + margin - origin_.x;
  double height = around.y_max + margin - origin_.y;
  const double least = 1e-9 * std::max(width, height);
  width = std::max(width, least);
  height = std::max(height, least);
  const auto cells =
      static_cast<double>(std::min(kCellsPerObstacle * obstacles.count(), kMaxCells));
  cell_ = std::max(std::sqrt(width * height / cells), std::max(width, height) / cells);
  columns_ = static_cast<Index>(width / cell_) + 1;
  rows_ = static_cast<Index>(height / cell_) + 1;
  fill(margin);
}

ObstacleGrid::Range ObstacleGrid::between(double low, double high, Index count) {
  return {std::max(floor_index(low - kRounding), Index{0}),
          std::min(floor_index(high + kRounding), count - 1)};
}

/// The rows of a column in which the core of obstacle `k` comes within `reach`.
ObstacleGrid::Range ObstacleGrid::rows_of(Index k, Index column, double reach) const {
  const Polygon core = obstacles_.cores[k];
  const double left = origin_.x + static_cast<double>(column) * cell_ - reach;
  const double right = left + cell_ + 2.0 * reach;
  double low = kInfinity;
  double high = -kInfinity;
  for (std::size_t i = 0; i < core.size(); ++i) {
    const Vec2 a = core[i];
    const Vec2 b = core[next_corner(core, i)];
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    // the part of the edge that lies in the column
    double from = 0.0;
    double to = 1.0;
    if (std::abs(dx) > 1e-9 * cell_) {
      const double u = (left - a.x) / dx;
      const double v = (right - a.x) / dx;
      from = std::max(from, std::min(u, v));
      to = std::min(to, std::max(u, v));
    } else if (a.x + std::max(dx, 0.0) < left || a.x + std::min(dx, 0.0) > right) {
      continue;
    }
    if (from <= to) {
      low = std::min(low, a.y + std::min(from * dy, to * dy));
      high = std::max(high, a.y + std::max(from * dy, to * dy));
    }
  }
  if (low > high) return {0, -1};
  return rows_between((low - reach - origin_.y) / cell_, (high + reach - origin_.y) / cell_);
}

/// Calls `visit(k, cell)` for every obstacle and every cell that it reaches into.
template <class Visit>
void ObstacleGrid::for_each_cell(double margin, Visit visit) const {
  for (Index k = 0; k < obstacles_.count(); ++k) {
    const double reach = obstacles_.radii[at(k)] + margin;
    const double low = obstacles_.boxes[at(k)].x_min - margin - origin_.x;
    const double high = obstacles_.boxes[at(k)].x_max + margin - origin_.x;
    const Range columns = columns_between(low / cell_, high / cell_);
    for (Index c = columns.first; c <= columns.last; ++c) {
      const Range rows = rows_of(k, c, reach);
      for (Index r = rows.first; r <= rows.last; ++r) visit(k, at(r * columns_ + c));
    }
  }
}

void ObstacleGrid::fill(double margin) {
  first_.assign(at(rows_ * columns_ + 1), 0);
  for_each_cell(margin, [&](Index, std::size_t cell) { ++first_[cell + 1]; });
  for (std::size_t cell = 0; cell + 1 < first_.size(); ++cell) first_[cell + 1] += first_[cell];
  items_.resize(at(first_.back()));
  std::vector<Index> used(first_.begin(), first_.end() - 1);
  for_each_cell(margin, [&](Index k, std::size_t cell) { items_[at(used[cell]++)] = k; });
}

GridSight::GridSight(const ObstacleGrid& grid)
    : grid_(grid), tested_(at(grid.obstacles().count()), 0) {}

bool GridSight::sees(Vec2 p, Vec2 q, double margin) {
  ++calls_;
  const double cell = grid_.cell();
  const Vec2 origin = grid_.origin();
  const double u0 = (p.x - origin.x) / cell;
  const double v0 = (p.y - origin.y) / cell;
  const double u1 = (q.x - origin.x) / cell;
  const double v1 = (q.y - origin.y) / cell;
  const double left = std::min(u0, u1) - kRounding;
  const double right = std::max(u0, u1) + kRounding;
  const double slope = std::abs(u1 - u0) > kRounding ? (v1 - v0) / (u1 - u0) : kInfinity;
  const ObstacleGrid::Range columns = grid_.columns_between(left, right);
  for (Index c = columns.first; c <= columns.last; ++c) {
    double low = std::min(v0, v1);
    double high = std::max(v0, v1);
    if (slope < kInfinity && slope > -kInfinity) {
      // only where the line crosses this column
      const double a = v0 + (std::max(left, static_cast<double>(c)) - u0) * slope;
      const double b = v0 + (std::min(right, static_cast<double>(c + 1)) - u0) * slope;
      low = std::max(low, std::min(a, b));
      high = std::min(high, std::max(a, b));
    }
    const ObstacleGrid::Range rows = grid_.rows_between(low, high);
    for (Index r = rows.first; r <= rows.last; ++r) {
      for (const Index k : grid_.in_cell(r, c)) {
        if (tested_[at(k)] == calls_) continue;
        tested_[at(k)] = calls_;
        if (crosses_obstacle(p, q, grid_.obstacles(), k, margin)) return false;
      }
    }
  }
  return true;
}

}  // namespace pushplan
