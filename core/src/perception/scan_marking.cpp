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

/// Marks of one scan.
class Marks {
 public:
  explicit Marks(const LogOdds& map)
      : map_(map), marks_(static_cast<std::size_t>(map.values.size()), Mark::none) {
    cells_.reserve(marks_.size());
  }

  void put(Index cell, Mark mark) {
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

/// Rows or columns along a ray, one after another (Amanatides and Woo 1987).
struct Walk {
  Index at;
  Index step;
  double next;      // way to the border of the next one, in cells
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

  bool is_in(Index count) const { return 0 <= at && at < count; }
};

}  // namespace

void mark_scan(const LogOdds& map, const Vec2& from, std::span<const double> bearings,
               std::span<const double> passed, std::span<const double> hits,
               const ScanEvidence& evidence) {
  Marks marks(map);
  const Index rows = map.values.extent(0);
  const Index columns = map.values.extent(1);
  const double x = (from.x - map.corner.x) / map.side;
  const double y = (from.y - map.corner.y) / map.side;
  for (std::size_t beam = 0; beam < bearings.size(); ++beam) {
    const Vec2 along{std::cos(bearings[beam]), std::sin(bearings[beam])};
    const double end = passed[beam] / map.side;
    Walk column(x, along.x);
    Walk row(y, along.y);
    for (double way = 0.0; way < end && column.is_in(columns) && row.is_in(rows);) {
      marks.put(row.at * columns + column.at, Mark::passed);
      way = std::min(column.next, row.next);
      (column.next < row.next ? column : row).advance();
    }
    if (!std::isfinite(hits[beam])) continue;
    const double away = hits[beam] / map.side;
    const Index hit_row = floor_index(y + away * along.y);
    const Index hit_column = floor_index(x + away * along.x);
    for (Index i = std::max<Index>(hit_row - 1, 0); i <= std::min(hit_row + 1, rows - 1); ++i) {
      for (Index j = std::max<Index>(hit_column - 1, 0);
           j <= std::min(hit_column + 1, columns - 1); ++j) {
        const bool is_it = i == hit_row && j == hit_column;
        marks.put(i * columns + j, is_it ? Mark::hit : Mark::beside);
      }
    }
  }
  marks.apply(evidence);
}

}  // namespace pushplan
