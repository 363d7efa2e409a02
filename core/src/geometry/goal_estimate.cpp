#include "pushplan/geometry/goal_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

constexpr double kMaxCells = 1'000'000.0;
constexpr double kMargin = 0.1;         // by which a side must be inside of an outline [cells]
constexpr double kOverlap = 0.05;       // by which outlines overlap that close a passage [cells]
constexpr double kLongest = 1.0198039;  // greatest ratio of a chamfer distance to the length
constexpr double kSlack = 3.0;  // of a distance, from places in cells to their centres [cells]
constexpr std::int32_t kUnreached = std::numeric_limits<std::int32_t>::max();

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

/// Adds the part of each line of constant `y` that an outline covers, with a margin above and below
/// it. Lengths are cells.
void add_chords(std::span<const Vec2> outline, std::span<std::vector<Chord>> lines) {
  double low = kInfinity;
  double high = -kInfinity;
  for (const Vec2 corner : outline) {
    low = std::min(low, corner.y);
    high = std::max(high, corner.y);
  }
  const Index first = std::max(Index{0}, ceil_index(low + kMargin));
  const Index last = std::min(static_cast<Index>(lines.size()) - 1, floor_index(high - kMargin));
  if (first > last) return;
  std::vector<Chord> chords(at(last - first + 1), Chord{-kInfinity, kInfinity});
  narrow(outline, static_cast<double>(first) - kMargin, chords);
  narrow(outline, static_cast<double>(first) + kMargin, chords);
  for (Index line = first; line <= last; ++line) {
    const Chord& chord = chords[at(line - first)];
    if (chord.left <= chord.right) lines[at(line)].push_back(chord);
  }
}

/// Closes the sides along lines that chords cover together, where two of them overlap surely. Side
/// i of a line goes from i to i + 1, and `sides` has `across` for each line and `along` between
/// them. No path goes below 0 or beyond `extent` along a line.
void cover(std::span<std::vector<Chord>> lines, double extent, Index along, Index across,
           std::span<std::uint8_t> sides) {
  const Index count = floor_index(extent) + 1;
  for (std::size_t line = 0; line < lines.size(); ++line) {
    std::vector<Chord>& chords = lines[line];
    std::ranges::sort(chords, {}, &Chord::left);
    for (std::size_t next = 0; next < chords.size();) {
      Chord run = chords[next++];
      while (next < chords.size() && chords[next].left <= run.right - kOverlap) {
        run.right = std::max(run.right, chords[next++].right);
      }
      const Index begin = run.left <= 0.0 ? 0 : std::max(Index{0}, ceil_index(run.left + kMargin));
      const Index end =
          run.right >= extent ? count : std::min(count, floor_index(run.right - kMargin));
      for (Index i = begin; i < end; ++i) {
        sides[at(static_cast<Index>(line) * across + i * along)] = 0;
      }
    }
  }
}

constexpr std::array<Index, 8> kAlong{1, 1, 0, -1, -1, -1, 0, 1};  // columns of a move
constexpr std::array<Index, 8> kUp{0, 1, 1, 1, 0, -1, -1, -1};     // rows of a move
constexpr std::array<std::int32_t, 2> kCosts{5, 7};  // of moves straight and slanting [fifths]
constexpr std::int32_t kKnight = 11;                 // of one of each, side by side
constexpr std::size_t kBuckets = 2 * kKnight + 1;    // a move changes a length by less

}  // namespace

CoveredSides::CoveredSides(Polygons outlines, const Box& box, double cell) {
  const double width = std::max(box.x_max - box.x_min, 0.0);
  const double height = std::max(box.y_max - box.y_min, 0.0);
  cell_ = std::max({cell, std::sqrt(width / kMaxCells) * std::sqrt(height),
                    std::max(width, height) / kMaxCells, std::numeric_limits<double>::min()});
  origin_ = {box.x_min, box.y_min};
  columns_ = floor_index(width / cell_) + 1;
  rows_ = floor_index(height / cell_) + 1;
  // whether the lower side of a cell in x, and the one in y, is open; with a closed frame around
  const Index width_in = columns_ + 2;
  std::vector<std::uint8_t> left(at((rows_ + 2) * width_in), 0);
  std::vector<std::uint8_t> below = left;
  for (Index row = 1; row <= rows_; ++row) {
    std::fill_n(&left[at(row * width_in + 2)], columns_ - 1, std::uint8_t{1});
    if (row > 1) std::fill_n(&below[at(row * width_in + 1)], columns_, std::uint8_t{1});
  }
  std::vector<std::vector<Chord>> lines_of_x(at(columns_));
  std::vector<std::vector<Chord>> lines_of_y(at(rows_));
  std::vector<Vec2> corners;  // [cells]
  for (Index k = 0; k < outlines.count(); ++k) {
    if (outlines[k].empty()) continue;
    corners.clear();
    for (const Vec2 corner : outlines[k]) {
      corners.push_back({(corner.x - origin_.x) / cell_, (corner.y - origin_.y) / cell_});
    }
    add_chords(corners, lines_of_y);
    for (Vec2& corner : corners) std::swap(corner.x, corner.y);
    add_chords(corners, lines_of_x);
  }
  const std::size_t inner = at(width_in + 1);  // the first cell within the frame
  cover(lines_of_y, width / cell_, 1, width_in, std::span(below).subspan(inner));
  cover(lines_of_x, height / cell_, width_in, 1, std::span(left).subspan(inner));
  moves_.resize(at(rows_ * columns_));
  for (Index row = 0; row < rows_; ++row) {  // of bytes alone, which compilers take by sixteen
    std::uint8_t* const moves = &moves_[at(row * columns_)];
    const std::uint8_t* const x = &left[inner + at(row * width_in)];
    const std::uint8_t* const y = &below[inner + at(row * width_in)];
    const std::uint8_t* const x_above = x + width_in;
    const std::uint8_t* const y_above = y + width_in;
    const std::uint8_t* const x_under = x - width_in;
    for (Index i = 0; i < columns_; ++i) {  // one straight move and another make a slanting one
      const int slants = ((y_above[i] & x_above[i + 1]) | (x[i + 1] & y_above[i + 1])) << 1 |
                         ((y_above[i] & x_above[i]) | (x[i] & y_above[i - 1])) << 3 |
                         ((y[i] & x_under[i]) | (x[i] & y[i - 1])) << 5 |
                         ((y[i] & x_under[i + 1]) | (x[i + 1] & y[i + 1])) << 7;
      moves[i] =
          static_cast<std::uint8_t>(x[i + 1] | y_above[i] << 2 | x[i] << 4 | y[i] << 6 | slants);
    }
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

GoalEstimate::GoalEstimate(const CoveredSides& cells, const Regions& regions, Vec2 start)
    : cells_(cells),
      wanted_(cells.cell_of(start)),
      distances_(at(cells.rows() * cells.columns()), kUnreached),
      buckets_(kBuckets),
      empty_(static_cast<std::int32_t>(kBuckets)),
      end_(kUnreached),
      rest_(kUnreached) {
  const double half = (1.0 + 1e-6) * cells.cell() * std::sqrt(0.5);  // a goal may lie on a corner
  const Index columns = cells.columns();
  for (Index row = 0; row < cells.rows(); ++row) {
    for (Index column = 0; column < columns; ++column) {
      const Index here = row * columns + column;
      const double beyond = (region_distance(cells.centre(here), regions) - half) / cells.cell();
      if (beyond <= 0.0) {
        distances_[at(here)] = 0;
        goals_.push_back(here);
      } else if (beyond > 2.0) {  // nor are the next ones in it
        column += static_cast<Index>(std::min(beyond, static_cast<double>(columns))) - 1;
      }
    }
  }
  std::sort(goals_.begin(), goals_.end(),
            [&](Index a, Index b) { return to_start(a) > to_start(b); });
}

std::int32_t GoalEstimate::to_start(Index cell) const {
  const Index columns = cells_.columns();
  const Index x = std::abs(cell % columns - wanted_ % columns);
  const Index y = std::abs(cell / columns - wanted_ / columns);
  const Index more = std::max(x, y);
  const Index less = std::min(x, y);
  return static_cast<std::int32_t>(std::max(5 * more + less, 4 * more + 3 * less));
}

bool GoalEstimate::run(Index cells) {
  while (rest_ == kUnreached) {
    if (empty_ == static_cast<std::int32_t>(kBuckets)) {
      if (goals_.empty()) return true;
      now_ = to_start(goals_.back());
      empty_ = 0;
    }
    std::vector<Index>& bucket = buckets_[static_cast<std::size_t>(now_) % kBuckets];
    for (; !goals_.empty() && to_start(goals_.back()) == now_; goals_.pop_back()) {
      bucket.push_back(goals_.back());
    }
    if (now_ > end_) {
      rest_ = now_;
      break;
    }
    if (cells <= 0) return false;
    empty_ = bucket.empty() ? empty_ + 1 : 0;
    cells -= static_cast<Index>(bucket.size());
    // a way may go on without becoming longer
    for (std::size_t i = 0; i < bucket.size(); ++i) spread(bucket[i]);
    bucket.clear();
    ++now_;
  }
  return true;
}

void GoalEstimate::spread(Index here) {
  const std::int32_t distance = distances_[at(here)];
  if (distance + to_start(here) != now_) return;  // there was a shorter way
  if (here == wanted_) end_ = now_ + now_ / 8 + 100;
  const Index columns = cells_.columns();
  const auto reach = [&](Index to, std::int32_t cost) {
    if (distances_[at(to)] <= distance + cost) return;
    distances_[at(to)] = distance + cost;
    const auto length = static_cast<std::size_t>(distance + cost + to_start(to));
    buckets_[length % kBuckets].push_back(to);
  };
  for (int direction = 0; direction < 8; ++direction) {
    const auto left = static_cast<std::size_t>(direction + 1) & 7;
    const Index first = here + kUp[at(direction)] * columns + kAlong[at(direction)];
    const Index second = here + kUp[left] * columns + kAlong[left];
    const bool leads = cells_.leads(here, direction);
    if (leads) reach(first, kCosts[at(direction & 1)]);
    if ((leads && cells_.leads(first, direction + 1)) ||
        (cells_.leads(here, direction + 1) && cells_.leads(second, direction))) {
      reach(first + second - here, kKnight);
    }
  }
}

double GoalEstimate::from(Vec2 p) const {
  const Index cell = cells_.cell_of(p);
  std::int32_t distance = distances_[at(cell)];
  if (rest_ != kUnreached) distance = std::min(distance, std::max(rest_ - to_start(cell), 0));
  if (distance == kUnreached) return kInfinity;
  const double cells = distance / (5.0 * kLongest) - kSlack;
  return (1.0 + kLonger) * cells_.cell() * std::max(cells, 0.0);
}

}  // namespace pushplan
