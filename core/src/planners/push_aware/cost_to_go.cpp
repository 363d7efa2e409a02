#include "pushplan/planners/push_aware/cost_to_go.hpp"

#include <cmath>
#include <utility>

#include "pushplan/arithmetic.hpp"
#include "pushplan/motion/dubins.hpp"
#include "pushplan/search/grid_dijkstra.hpp"

namespace pushplan {
namespace {

constexpr double kLeastWeight = 0.25;  // of the cells with a value, for an interpolated one
constexpr double kSome = 1e-9;         // weight from which a cell counts
constexpr double kLargest = 1e9;       // change of a value that was infinite [m]
constexpr double kCell = 0.33;         // side of a cell [R]
constexpr double kCoarsest = 0.8;      // side beyond which a table would not resolve the robot [R]
constexpr double kMostCells = 16'000;  // (x, y) at most; larger maps get larger cells
constexpr double kArc = 2.0;           // length of the arcs that carry values [cells]
constexpr double kSettled = 0.02;      // change of a value below which the table is done [R]
constexpr Index kMostSweeps = 60;
constexpr Index kBlock = 60;                             // cells that are worked on in a step
constexpr std::array<double, 3> kSides{-1.0, 0.0, 1.0};  // of the arcs, in greatest curvatures

double least_cell(const Box& bounds, double size) {
  const double width = bounds.x_max - bounds.x_min;
  const double height = bounds.y_max - bounds.y_min;
  return std::max(
      {kCell * size, std::sqrt(width * height / kMostCells), std::max(width, height) / kMostCells});
}

bool is_finite(const Box& box) {
  return std::isfinite(box.x_max - box.x_min) && std::isfinite(box.y_max - box.y_min);
}

Index cells_along(double length, double cell) {
  return std::max(static_cast<Index>(std::ceil(length / cell)), Index{1});
}

/// Two neighbouring headings of a table.
struct HeadingPair {
  std::array<Index, 2> index;
  std::array<double, 2> weight;
};

HeadingPair headings_around(double theta, Index headings) {
  const auto count = static_cast<double>(headings);
  const double place = floor_mod(theta / kTurn * count, count);
  const auto whole = static_cast<Index>(place);
  const double part = place - static_cast<double>(whole);
  const Index first = floor_mod(whole, headings);
  return {{first, floor_mod(first + 1, headings)}, {1.0 - part, part}};
}

/// Interpolates between cells; those without a value do not count, and it is infinite if too few
/// have one.
double interpolate(ArrayView<const double, 3> values, const Cells& cells, Vec2 p,
                   const HeadingPair& heading) {
  const double u = (p.x - cells.origin.x) / cells.step - 0.5;
  const double v = (p.y - cells.origin.y) / cells.step - 0.5;
  const Index column = floor_index(u);
  const Index row = floor_index(v);
  const double across = u - static_cast<double>(column);
  const double down = v - static_cast<double>(row);
  double total = 0.0;
  double weight = 0.0;
  for (Index di = 0; di < 2; ++di) {
    const Index r = row + di;
    if (r < 0 || r >= values.extent(0)) continue;
    const double of_row = di == 1 ? down : 1.0 - down;
    for (Index dj = 0; dj < 2; ++dj) {
      const Index c = column + dj;
      if (c < 0 || c >= values.extent(1)) continue;
      const double of_cell = of_row * (dj == 1 ? across : 1.0 - across);
      const double* here = &values(r, c, Index{0});
      for (std::size_t k = 0; k < 2; ++k) {
        const double w = of_cell * heading.weight[k];
        const double value = here[heading.index[k]];
        if (w > kSome && value < kInfinity) {
          total += w * value;
          weight += w;
        }
      }
    }
  }
  return weight > kLeastWeight ? total / weight : kInfinity;
}

/// Marks which of the cells from `first` to `last` (exclusive), counted row by row, hold the
/// footprint. `free` is (rows, columns, headings).
void mark_free(ArrayView<bool, 3> free, Index first, Index last, const Cells& cells,
               const Footprint& footprint, const ConvexObstacles& walls) {
  CollisionChecker checker(footprint, walls);
  const Index columns = free.extent(1);
  const Index headings = free.extent(2);
  for (Index at = first; at < last; ++at) {
    const Index r = at / columns;
    const Index c = at % columns;
    const Vec2 centre = cells.centre(r, c);
    for (Index k = 0; k < headings; ++k) {
      const double theta = kTurn * static_cast<double>(k) / static_cast<double>(headings);
      free(r, c, k) = checker.is_free({centre.x, centre.y, theta});
    }
  }
}

/// Grid lengths to a goal.
struct Flood {
  std::vector<double> lengths;  // of each cell, row by row [m]
  std::vector<Index> order;     // the cells in the order of their lengths
};

/// Floods the open cells, (rows, columns), from a goal. `centre` is the cell of the goal's middle,
/// negative for none: a disc may be smaller than a cell.
Flood flood(ArrayView<const bool, 2> open, const Cells& cells, const GoalRegion& goal,
            Index centre) {
  const Index columns = open.extent(1);
  std::vector<Index> starts;
  std::vector<double> weights(static_cast<std::size_t>(open.size()), kInfinity);
  for (Index at = 0; at < open.size(); ++at) {
    const bool is_open = open.data()[at];
    if (is_open) weights[static_cast<std::size_t>(at)] = 1.0;
    const bool in_goal = is_open && goal.contains(cells.centre(at / columns, at % columns));
    if (in_goal || at == centre) starts.push_back(at);
  }
  const ZeroedArray<bool> no_goals(open.size());
  GridDijkstra search({weights.data(), open.shape()}, cells.step, starts);
  search.settle({no_goals.data(), open.shape()}, open.size());
  const auto costs = search.costs();
  return {{costs.data(), costs.data() + costs.size()},
          {search.order().begin(), search.order().end()}};
}

/// Where short arcs lead to from each heading of a table.
struct ArcEnds {
  ArrayView<const Pose, 2> ends;  // (headings, arcs) displacement, and heading at the end
  double length;                  // of the arcs [m]
};

/// One Gauss-Seidel sweep over the cells in some order, by their distances from the goal. `values`
/// are those of the table. Returns the greatest change [m].
double sweep_cost_to_go(ArrayView<double, 3> values, const CostToGo& table,
                        ArrayView<const bool, 3> free, std::span<const Index> order,
                        const ArcEnds& arcs) {
  const Index columns = table.columns();
  const Index headings = table.headings();
  const Index count = arcs.ends.extent(1);
  std::vector<HeadingPair> end_headings;
  for (Index i = 0; i < arcs.ends.size(); ++i) {
    end_headings.push_back(headings_around(arcs.ends.data()[i].theta, headings));
  }
  double change = 0.0;
  for (const Index at : order) {
    const Index r = at / columns;
    const Index c = at % columns;
    if (table.floor(r, c) == 0.0) continue;
    const Vec2 centre = table.cells.centre(r, c);
    for (Index k = 0; k < headings; ++k) {
      if (!free(r, c, k)) continue;
      double best = values(r, c, k);
      for (Index a = 0; a < count; ++a) {
        const Pose& end = arcs.ends(k, a);
        const HeadingPair& heading = end_headings[static_cast<std::size_t>(k * count + a)];
        const Vec2 place{centre.x + end.x, centre.y + end.y};
        const double value = arcs.length + interpolate(values, table.cells, place, heading);
        if (value < best) best = value;
      }
      if (best < values(r, c, k)) {
        change = std::max(change, std::min(values(r, c, k), kLargest) - best);
        values(r, c, k) = best;
      }
    }
  }
  return change;
}

}  // namespace

Index CostToGo::heading_of(double theta) const {
  const auto count = static_cast<double>(headings());
  return floor_mod(floor_index(theta / kTurn * count + 0.5), headings());
}

double CostToGo::length_to_go(const Pose& pose) const {
  const double value =
      interpolate(values, cells, {pose.x, pose.y}, headings_around(pose.theta, headings()));
  return value == kInfinity ? floor(row_of(pose.y), column_of(pose.x)) : value;
}

CostToGoMaker::CostToGoMaker(const Footprint& footprint, const ConvexObstacles& walls,
                             const GoalRegion& goal, double size, double radius, Index headings)
    : footprint_(footprint),
      walls_(walls),
      goal_(goal),
      cells_{{walls.bounds.x_min, walls.bounds.y_min}, least_cell(walls.bounds, size)},
      useful_(is_finite(walls.bounds) && cells_.step <= kCoarsest * size && size < kInfinity),
      done_(!useful_),
      rows_(useful_ ? cells_along(walls.bounds.y_max - walls.bounds.y_min, cells_.step) : 1),
      columns_(useful_ ? cells_along(walls.bounds.x_max - walls.bounds.x_min, cells_.step) : 1),
      headings_(headings),
      settled_(kSettled * size),
      length_(kArc * cells_.step),
      free_(cell_count() * headings),
      values_(static_cast<std::size_t>(cell_count() * headings), kInfinity),
      floor_(static_cast<std::size_t>(cell_count()), kInfinity) {
  for (Index k = 0; k < headings; ++k) {
    const double theta = kTurn * static_cast<double>(k) / static_cast<double>(headings);
    for (const double side : kSides) {
      ends_.push_back(along_arc({0.0, 0.0, theta}, {length_, side / radius}));
    }
  }
}

CostToGo CostToGoMaker::table() const {
  return {
      {values_.data(), {rows_, columns_, headings_}}, {floor_.data(), {rows_, columns_}}, cells_};
}

void CostToGoMaker::step() {
  if (done_) return;
  if (!flooded()) {
    const Index last = std::min(marked_ + kBlock, cell_count());
    mark_free(free(), marked_, last, cells_, footprint_, walls_);
    marked_ = last;
    if (flooded()) flood_cells();
    return;
  }
  const std::size_t last = std::min(at_ + static_cast<std::size_t>(kBlock), order_.size());
  const ArcEnds arcs{{ends_.data(), {headings_, Index{kSides.size()}}}, length_};
  const double change = sweep_cost_to_go({values_.data(), {rows_, columns_, headings_}}, table(),
                                         free(), std::span(order_).subspan(at_, last - at_), arcs);
  change_ = std::max(change_, change);
  at_ = last;
  if (last < order_.size()) return;
  ++sweeps_;
  done_ = change_ < settled_ || sweeps_ >= kMostSweeps;
  at_ = 0;
  change_ = 0.0;
}

void CostToGoMaker::flood_cells() {
  const auto fits = [&](Index at) {
    const bool* flags = free_.data() + at * headings_;
    return std::any_of(flags, flags + headings_, [](bool flag) { return flag; });
  };
  const ZeroedArray<bool> open(cell_count());
  for (Index at = 0; at < cell_count(); ++at) open[at] = fits(at);
  Index centre = -1;
  if (goal_.kind == GoalRegion::Kind::kDisc) {
    const double x = (goal_.point.x - cells_.origin.x) / cells_.step;
    const double y = (goal_.point.y - cells_.origin.y) / cells_.step;
    if (x >= 0.0 && x < static_cast<double>(columns_) && y >= 0.0 &&
        y < static_cast<double>(rows_)) {
      centre = static_cast<Index>(y) * columns_ + static_cast<Index>(x);
    }
  }
  Flood found = flood({open.data(), {rows_, columns_}}, cells_, goal_, centre);
  floor_ = std::move(found.lengths);
  order_ = std::move(found.order);
  for (Index at = 0; at < cell_count(); ++at) {
    if (floor_[static_cast<std::size_t>(at)] != 0.0) continue;
    for (Index k = at * headings_; k < (at + 1) * headings_; ++k) {
      if (free_[k]) values_[static_cast<std::size_t>(k)] = 0.0;
    }
  }
}

}  // namespace pushplan
