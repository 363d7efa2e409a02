#include "pushplan/perception/scan_marking.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace pushplan {
namespace {

/// Beams of one scan in a cell, and ends of beams beside it.
struct Beams {
  std::uint32_t passed = 0;
  std::uint32_t hits = 0;
  std::uint32_t beside = 0;
};

/// Beams of one scan in the cells that it may change.
class Marks {
 public:
  Marks(const LogOdds& map, const CellWindow& window)
      : map_(map), window_(window), columns_(window.end_column - window.column),
        beams_(static_cast<std::size_t>((window.end_row - window.row) * columns_)) {}

  Beams& at(Index row, Index column) {
    const Index cell = (row - window_.row) * columns_ + column - window_.column;
    return beams_[static_cast<std::size_t>(cell)];
  }

  void apply(const ScanEvidence& evidence) {
    auto beams = beams_.begin();
    for (Index row = window_.row; row < window_.end_row; ++row) {
      double* value = map_.values.data() + row * map_.values.extent(1) + window_.column;
      for (Index column = 0; column < columns_; ++column, ++value, ++beams) {
        const double all = beams->passed + beams->hits;
        if (all == 0.0) continue;
        double change = beams->hits > 0 ? evidence.hit : evidence.miss;
        if (evidence.averaged) {
          change = (beams->hits * evidence.hit + beams->passed * evidence.miss) / all;
        } else if (beams->hits == 0 && beams->beside > 0) {
          continue;  // beams that graze a wall pass its cells
        }
        *value = std::clamp(*value + change, evidence.lowest, evidence.highest);
        if (*value == 0.0) *value = -std::numeric_limits<double>::min();
      }
    }
  }

 private:
  LogOdds map_;
  CellWindow window_;
  Index columns_;
  std::vector<Beams> beams_;
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

  bool is_in(Index low, Index high) const { return low <= at && at < high; }
};

/// A place in cells, beyond a map of so many no farther than two.
double limited(double at, Index count) {
  return std::clamp(at, -2.0, static_cast<double>(count) + 2.0);
}

/// The cells of a map up to one beyond the ends of all beams.
CellWindow window_of(const LogOdds& map, const Vec2& from, std::span<const double> bearings,
                     std::span<const double> passed, std::span<const double> hits) {
  Vec2 low = from;
  Vec2 high = from;
  for (std::size_t beam = 0; beam < bearings.size(); ++beam) {
    const double away = std::max(passed[beam], std::isfinite(hits[beam]) ? hits[beam] : 0.0);
    const Vec2 end{from.x + away * std::cos(bearings[beam]), from.y + away * std::sin(bearings[beam])};
    low = {std::min(low.x, end.x), std::min(low.y, end.y)};
    high = {std::max(high.x, end.x), std::max(high.y, end.y)};
  }
  const auto cell = [&](double place, double corner, Index beyond, Index count) {
    const Index at = floor_index(limited((place - corner) / map.side, count));
    return std::clamp<Index>(at + beyond, 0, count);
  };
  const Index rows = map.values.extent(0);
  const Index columns = map.values.extent(1);
  return {cell(low.y, map.corner.y, -1, rows), cell(low.x, map.corner.x, -1, columns),
          cell(high.y, map.corner.y, 2, rows), cell(high.x, map.corner.x, 2, columns)};
}

}  // namespace

CellWindow mark_scan(const LogOdds& map, const Vec2& from, std::span<const double> bearings,
                     std::span<const double> passed, std::span<const double> hits,
                     const ScanEvidence& evidence) {
  const CellWindow window = window_of(map, from, bearings, passed, hits);
  Marks marks(map, window);
  const double x = limited((from.x - map.corner.x) / map.side, map.values.extent(1));
  const double y = limited((from.y - map.corner.y) / map.side, map.values.extent(0));
  for (std::size_t beam = 0; beam < bearings.size(); ++beam) {
    const Vec2 along{std::cos(bearings[beam]), std::sin(bearings[beam])};
    const double end = passed[beam] / map.side;
    Walk column(x, along.x);
    Walk row(y, along.y);
    for (double way = 0.0; way < end && column.is_in(window.column, window.end_column) &&
                           row.is_in(window.row, window.end_row);) {
      ++marks.at(row.at, column.at).passed;
      way = std::min(column.next, row.next);
      (column.next < row.next ? column : row).advance();
    }
    if (!std::isfinite(hits[beam])) continue;
    const double away = hits[beam] / map.side;
    const Index hit_row = floor_index(limited(y + away * along.y, map.values.extent(0)));
    const Index hit_column = floor_index(limited(x + away * along.x, map.values.extent(1)));
    for (Index i = std::max(hit_row - 1, window.row); i < std::min(hit_row + 2, window.end_row); ++i) {
      for (Index j = std::max(hit_column - 1, window.column);
           j < std::min(hit_column + 2, window.end_column); ++j) {
        const bool is_it = i == hit_row && j == hit_column;
        ++(is_it ? marks.at(i, j).hits : marks.at(i, j).beside);
      }
    }
  }
  marks.apply(evidence);
  return window;
}

}  // namespace pushplan
