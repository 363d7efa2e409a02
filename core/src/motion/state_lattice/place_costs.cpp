#include "pushplan/motion/state_lattice/place_costs.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pushplan {
namespace {

/// Lets each value be reached from the others at `cost` for each cell across.
void drift(std::span<double> values, double cost) {
  if (values.empty()) return;
  for (std::size_t i = 1; i < values.size(); ++i) {
    values[i] = std::min(values[i], values[i - 1] + cost);
  }
  for (std::size_t i = values.size() - 1; i-- > 0;) {
    values[i] = std::min(values[i], values[i + 1] + cost);
  }
}

}  // namespace

void place_costs(ArrayView<const double, 2> sums, const LatticePlaces& places,
                 const HullWindow& window, ArrayView<double, 2> costs) {
  const Index width = sums.extent(0);
  const Index rows = sums.extent(1) - 1;
  const Index first = places.first;
  const Index last = places.last;
  const Index half = window.half;
  const double ahead = window.cell * std::cos(window.lean);
  const double across = window.cell * std::sin(window.lean);
  const double scale =
      window.factor * static_cast<double>(window.stage) / static_cast<double>(2 * window.along + 1);
  const double stage_ahead = static_cast<double>(window.stage) * ahead;
  std::fill_n(costs.data(), costs.size(), 0.0);
  std::vector<double> values(at(width), 0.0);  // from each column of the last row, with its cover
  std::vector<double> near(at(width));
  std::vector<double> line(at(width));
  const auto between = [&](std::vector<double>& all) {
    return std::span(all).subspan(at(first), at(std::max(last - first + 1, Index{0})));
  };
  Index u = static_cast<Index>(places.rows.size()) - 1;
  for (Index row = std::min(places.goal_row, rows) - 1; row >= 0; row -= window.stage) {
    while (u >= 0 && std::min(places.rows[at(u)] + window.reach, places.goal_row - 1) >= row) {
      near = values;
      drift(between(near), across);
      const Index gap = places.goal_row - places.rows[at(u)];
      if (gap > 0) {
        const double to_go = ahead * static_cast<double>(std::min(window.reach + 1, gap));
        for (std::size_t v = 0; v < places.columns.size(); ++v) {
          const Index column = std::min(std::max(places.columns[v], first), last);
          costs(u, v) = near[at(column)] + to_go;
        }
      }
      --u;
    }
    drift(between(values), across);
    const Index low = std::max(row - window.along, Index{0});
    const Index high = std::min(row + window.along + 1, rows);
    for (Index column = std::max(first - half, Index{0}); column < std::min(last + half + 1, width);
         ++column) {
      line[at(column)] = scale * (sums(column, high) - sums(column, low));
    }
    double total = 0.0;
    for (Index column = std::max(first - half, Index{0}); column < std::min(first + half, width);
         ++column) {
      total += line[at(column)];
    }
    for (Index column = first; column <= last; ++column) {
      if (column + half < width) total += line[at(column + half)];
      if (column - half - 1 >= 0 && column > first) total -= line[at(column - half - 1)];
      // sliding sums lose digits, a bound must not
      values[at(column)] += stage_ahead + std::max(total - 1e-9 * std::abs(total) - 1e-12, 0.0);
    }
  }
}

}  // namespace pushplan
