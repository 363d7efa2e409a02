#include "pushplan/perception/scan_marking.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace pushplan {
namespace {

/// A cell beside one that is hit stays as it is: beams that graze a wall pass its cells.
enum class Mark : std::uint8_t { none, passed, beside, hit };

/// Marks of one scan in the box that its beams reach.
class Marks {
 public:
  explicit Marks(const LogOdds& map)
      : map_(map), marks_(static_cast<std::size_t>(map.values.size()), Mark::none) {}

  void put(Index row, Index column, Mark mark) {
    const Index columns = map_.values.extent(1);
    if (row < 0 || column < 0 || row >= map_.values.extent(0) || column >= columns) return;
    const Index cell = row * columns + column;
    Mark& old = marks_[static_cast<std::size_t>(cell)];
    if (old == Mark::none) cells_.push_back(cell);
    old = std::max(old, mark);
  }

  void apply(const ScanEvidence& evidence) {
    for (const Index cell : cells_) {
      double& value = map_.values.data()[cell];
      const Mark mark = marks_[static_cast<std::size_t>(cell)];
      if (mark == Mark::beside) continue;
      const double change = mark == Mark::hit ? evidence.hit : evidence.miss;
      value = std::clamp(value + change, evidence.lowest, evidence.highest);
      if (value == 0.0) value = -std::numeric_limits<double>::min();
    }
  }

 private:
  LogOdds map_;
  std::vector<Mark> marks_;
  std::vector<Index> cells_;
};

/// Cells along a ray, one after another (Amanatides and Woo 1987).
struct Walk {
  Index at;         // row or column
  Index step;
  double next;      // way to the border of the next cell, in cells
  double interval;  // between two borders

  Walk(double start, double direction)
      : at(direction < 0.0 ? ceil_index(start) - 1 : floor_index(start)),
        step(direction < 0.0 ? -1 : 1), interval(1.0 / std::max(std::abs(direction), 1e-300)) {
    const double inside = start - static_cast<double>(at);
    next = interval * (direction < 0.0 ? inside : 1.0 - inside);
  }

  void advance() {
    at += step;
    next += interval;
  }
};

}  // namespace

void mark_scan(const LogOdds& map, const Vec2& from, std::span<const double> bearings,
               std::span<const double> passed, std::span<const double> hits,
               const ScanEvidence& evidence) {
  Marks marks(map);
  const double x = (from.x - map.corner.x) / map.side;
  const double y = (from.y - map.corner.y) / map.side;
  for (std::size_t beam = 0; beam < bearings.size(); ++beam) {
    const Vec2 along{std::cos(bearings[beam]), std::sin(bearings[beam])};
    const double end = passed[beam] / map.side;
    Walk column(x, along.x);
    Walk row(y, along.y);
    for (double way = 0.0; way < end; way = std::min(column.next, row.next)) {
      if (way > 0.0) (column.next < row.next ? column : row).advance();
      marks.put(row.at, column.at, Mark::passed);
      if (std::min(column.next, row.next) <= way) break;  // no number is that exact any more
    }
    if (std::isfinite(hits[beam])) {
      const double away = hits[beam] / map.side;
      const Index at_row = floor_index(y + away * along.y);
      const Index at_column = floor_index(x + away * along.x);
      for (Index i = -1; i <= 1; ++i) {
        for (Index j = -1; j <= 1; ++j) {
          marks.put(at_row + i, at_column + j, i == 0 && j == 0 ? Mark::hit : Mark::beside);
        }
      }
    }
  }
  marks.apply(evidence);
}

}  // namespace pushplan
