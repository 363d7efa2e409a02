#include "pushplan/geometry/goal_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMaxCells = 500'000.0;
constexpr double kMargin = 0.1;         // by which a side must be inside of an outline [cells]
constexpr double kLongest = 1.0198039;  // greatest ratio of a chamfer distance to the length
constexpr double kSlack = 3.0;  // of a distance, from places in cells to their centres [cells]
constexpr std::int32_t kUnreached = std::numeric_limits<std::int32_t>::max();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// The part of a horizontal line that is inside of a convex outline.
struct Chord {
  double left = kInfinity;
  double right = -kInfinity;
};

/// Narrows chords to the parts of lines y = `first`, `first + 1`, ... inside of a convex outline.
void narrow(std::span<const Vec2> outline, double first, std::span<Chord> chords) {
  std::vector<Chord> inside(chords.size());
  const auto last = static_cast<Index>(chords.size()) - 1;
  Vec2 to = outline.back();
  for (const Vec2 corner : outline) {
    const Vec2 from = to;
    to = corner;
    const Index begin = std::max(Index{0}, ceil_index(std::min(from.y, to.y) - first));
    const Index end = std::min(last, floor_index(std::max(from.y, to.y) - first));
    for (Index line = begin; line <= end; ++line) {
      Chord& chord = inside[at(line)];
      const double height = to.y - from.y;
      const double part =
          height == 0.0 ? 0.0 : (first + static_cast<double>(line) - from.y) / height;
      const double x = from.x + part * (to.x - from.x);
      chord.left = std::min(chord.left, x);
      chord.right = std::max(chord.right, x);
    }
  }
  for (std::size_t i = 0; i < chords.size(); ++i) {
    chords[i].left = std::max(chords[i].left, inside[i].left);
    chords[i].right = std::min(chords[i].right, inside[i].right);
  }
}

/// Marks the sides along lines of constant `y` that an outline covers, with a margin around them.
/// Lengths are cells; side i of a line goes from i to i + 1, and `sides` has `across` for each line
/// and `along` between them. No path goes below 0 or beyond `extent` along a line.
void cover(std::span<const Vec2> outline, Index lines, double extent, Index along, Index across,
           std::vector<char>& sides) {
  double low = kInfinity;
  double high = -kInfinity;
  for (const Vec2 corner : outline) {
    low = std::min(low, corner.y);
    high = std::max(high, corner.y);
  }
  const Index first = std::max(Index{0}, ceil_index(low + kMargin));
  const Index last = std::min(lines - 1, floor_index(high - kMargin));
  const Index count = floor_index(extent) + 1;
  if (first > last) return;
  std::vector<Chord> chords(at(last - first + 1), Chord{-kInfinity, kInfinity});
  narrow(outline, static_cast<double>(first) - kMargin, chords);
  narrow(outline, static_cast<double>(first) + kMargin, chords);
  for (Index line = first; line <= last; ++line) {
    const Chord& chord = chords[at(line - first)];
    if (!(chord.left <= chord.right)) continue;
    const Index begin =
        chord.left <= 0.0 ? 0 : std::max(Index{0}, ceil_index(chord.left + kMargin));
    const Index end =
        chord.right >= extent ? count : std::min(count, floor_index(chord.right - kMargin));
    for (Index i = begin; i < end; ++i) sides[at(line * across + i * along)] = 1;
  }
}

struct Move {
  Index row;
  Index column;
  std::int32_t cost;  // [fifths of a cell]
};

constexpr std::array<Move, 16> kMoves{{{0, 1, 5},
                                       {1, 0, 5},
                                       {0, -1, 5},
                                       {-1, 0, 5},
                                       {1, 1, 7},
                                       {1, -1, 7},
                                       {-1, -1, 7},
                                       {-1, 1, 7},
                                       {1, 2, 11},
                                       {2, 1, 11},
                                       {2, -1, 11},
                                       {1, -2, 11},
                                       {-1, -2, 11},
                                       {-2, -1, 11},
                                       {-2, 1, 11},
                                       {-1, 2, 11}}};
constexpr std::size_t kBuckets = 12;  // more than the greatest cost

}  // namespace

CoveredSides::CoveredSides(Polygons outlines, const Box& box, double cell) {
  const double width = std::max(box.x_max - box.x_min, 0.0);
  const double height = std::max(box.y_max - box.y_min, 0.0);
  cell_ = std::max({cell, std::sqrt(width / kMaxCells) * std::sqrt(height),
                    std::max(width, height) / kMaxCells, std::numeric_limits<double>::min()});
  origin_ = {box.x_min, box.y_min};
  columns_ = floor_index(width / cell_) + 1;
  rows_ = floor_index(height / cell_) + 1;
  left_.assign(at(rows_ * columns_), 0);
  below_.assign(at(rows_ * columns_), 0);
  std::vector<Vec2> corners;  // [cells]
  for (Index k = 0; k < outlines.count(); ++k) {
    if (outlines[k].empty()) continue;
    corners.clear();
    for (const Vec2 corner : outlines[k]) {
      corners.push_back({(corner.x - origin_.x) / cell_, (corner.y - origin_.y) / cell_});
    }
    cover(corners, rows_, width / cell_, 1, columns_, below_);
    for (Vec2& corner : corners) std::swap(corner.x, corner.y);
    cover(corners, columns_, height / cell_, columns_, 1, left_);
  }
}

Index CoveredSides::cell_of(Vec2 p) const {
  const Index column = floor_index((p.x - origin_.x) / cell_);
  const Index row = floor_index((p.y - origin_.y) / cell_);
  return std::clamp(row, Index{0}, rows_ - 1) * columns_ +
         std::clamp(column, Index{0}, columns_ - 1);
}

Vec2 CoveredSides::centre(Index cell) const {
  return {origin_.x + (static_cast<double>(cell % columns_) + 0.5) * cell_,
          origin_.y + (static_cast<double>(cell / columns_) + 0.5) * cell_};
}

bool CoveredSides::covered(Index cell, Index neighbour) const {
  const Index higher = std::max(cell, neighbour);
  const bool beside = higher - std::min(cell, neighbour) == 1;
  return (beside ? left_ : below_)[at(higher)] != 0;
}

GoalEstimate::GoalEstimate(const CoveredSides& cells, const Regions& regions, Vec2 start)
    : cells_(cells), distances_(at(cells.rows() * cells.columns()), kUnreached) {
  const Index rows = cells.rows();
  const Index columns = cells.columns();
  const Index wanted = cells.cell_of(start);
  std::array<std::vector<Index>, kBuckets> buckets;
  const double half = (1.0 + 1e-6) * cells.cell() * std::sqrt(0.5);  // a goal may lie on a corner
  for (Index i = 0; i < rows * columns; ++i) {
    if (region_distance(cells.centre(i), regions) <= half) {
      distances_[at(i)] = 0;
      buckets[0].push_back(i);
    }
  }
  const auto slants = [&](Index from, Index to) {  // by one straight move and another
    const Index first = from / columns * columns + to % columns;
    const Index second = to / columns * columns + from % columns;
    return (!cells.covered(from, first) && !cells.covered(first, to)) ||
           (!cells.covered(from, second) && !cells.covered(second, to));
  };
  std::int32_t end = kUnreached;  // beyond what matters
  std::int32_t empty = 0;         // buckets in a row
  rest_ = kUnreached;
  for (std::int32_t now = 0; empty < static_cast<std::int32_t>(kBuckets); ++now) {
    std::vector<Index>& bucket = buckets[static_cast<std::size_t>(now) % kBuckets];
    empty = bucket.empty() ? empty + 1 : 0;
    if (now > end) {
      rest_ = now;
      break;
    }
    for (const Index here : bucket) {
      if (distances_[at(here)] != now) continue;
      if (here == wanted) end = now + now / 8 + 100;
      const Index row = here / columns;
      const Index column = here % columns;
      for (const Move& move : kMoves) {
        const Index r = row + move.row;
        const Index c = column + move.column;
        if (r < 0 || c < 0 || r >= rows || c >= columns) continue;
        const Index to = r * columns + c;
        if (distances_[at(to)] <= now + move.cost) continue;
        if (move.cost == 5 && cells.covered(here, to)) continue;
        if (move.cost == 7 && !slants(here, to)) continue;
        if (move.cost == 11) {  // a straight move and a slanting one, in either order
          const Index first = (row + move.row / 2) * columns + column + move.column / 2;
          const Index second = (r - move.row / 2) * columns + c - move.column / 2;
          if ((cells.covered(here, first) || !slants(first, to)) &&
              (!slants(here, second) || cells.covered(second, to))) {
            continue;
          }
        }
        distances_[at(to)] = now + move.cost;
        buckets[static_cast<std::size_t>(now + move.cost) % kBuckets].push_back(to);
      }
    }
    bucket.clear();
  }
}

double GoalEstimate::from(Vec2 p) const {
  std::int32_t distance = std::min(distances_[at(cells_.cell_of(p))], rest_);
  if (distance == kUnreached) return kInfinity;
  const double cells = distance / (5.0 * kLongest) - kSlack;
  return (1.0 + kLonger) * cells_.cell() * std::max(cells, 0.0);
}

}  // namespace pushplan
