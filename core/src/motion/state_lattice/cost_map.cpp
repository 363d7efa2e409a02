#include "pushplan/motion/state_lattice/cost_map.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

CellSpan rows_of(Polygon outline) {
  CellSpan rows{outline[0].x, outline[0].x};
  for (const Vec2 corner : outline) {
    rows.low = std::min(rows.low, corner.x);
    rows.high = std::max(rows.high, corner.x);
  }
  return rows;
}

/// Columns of a convex outline within `margin` of a row; from infinity to minus infinity where
/// there is none.
CellSpan columns_near(Polygon outline, double row, double margin) {
  CellSpan columns{kInfinity, -kInfinity};
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 p = outline[i];
    const Vec2 q = outline[i + 1 < outline.size() ? i + 1 : 0];
    const double a = p.x - row;
    const double b = q.x - row;
    double low = 0.0;
    double high = 1.0;
    if (a != b) {
      const double u = (-margin - a) / (b - a);
      const double v = (margin - a) / (b - a);
      low = std::max(low, std::min(u, v));
      high = std::min(high, std::max(u, v));
    } else if (std::abs(a) > margin) {
      continue;
    }
    if (low <= high) {
      const double along = q.y - p.y;
      columns.low = std::min(columns.low, p.y + std::min(low * along, high * along));
      columns.high = std::max(columns.high, p.y + std::max(low * along, high * along));
    }
  }
  return columns;
}

/// True if a cell lies within the root of `reach` of an outline, which may be a square.
bool near_outline(Polygon outline, double row, double column, double reach) {
  bool inside = true;
  double nearest = kInfinity;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 p = outline[i];
    const Vec2 q = outline[i + 1 < outline.size() ? i + 1 : 0];
    const double ex = q.x - p.x;
    const double ey = q.y - p.y;
    const double px = row - p.x;
    const double py = column - p.y;
    if (ex * py - ey * px < 0.0) inside = false;
    const double t = std::min(std::max((px * ex + py * ey) / (ex * ex + ey * ey), 0.0), 1.0);
    const double dx = px - t * ex;
    const double dy = py - t * ey;
    nearest = std::min(nearest, dx * dx + dy * dy);
  }
  return inside || nearest <= reach;
}

/// A floe on a map, with the weights of its cells.
template <class Weight>
class SpreadFloe {
 public:
  SpreadFloe(Polygon outline, Vec2 centre, double radius, const Weight& weight)
      : outline_(outline),
        centre_(centre),
        inverse_square_(1.0 / std::max(radius * radius, 1e-12)),
        weight_(weight) {}

  /// Calls `visit(row, column, weight)` for the cells in some rows.
  template <class Visit>
  void cells(Index first, Index last, const Visit& visit) const {
    for (Index row = first; row <= last; ++row) {
      const CellSpan columns = row_span(outline_, static_cast<double>(row));
      if (columns.low > columns.high) continue;
      const double down = static_cast<double>(row) - centre_.x;
      const double down_square = down * down;
      const Index end = floor_index(columns.high);
      for (Index column = ceil_index(columns.low); column <= end; ++column) {
        const double across = static_cast<double>(column) - centre_.y;
        visit(row, column,
              weight_(std::min((down_square + across * across) * inverse_square_, 1.0)));
      }
    }
  }

 private:
  Polygon outline_;
  Vec2 centre_;
  double inverse_square_;
  const Weight& weight_;
};

/// `weight(q)` is the weight of a cell at the distance whose square is q.
template <class Weight>
void add_weighted(const PlacedFloes& floes, const Weight& weight, ArrayView<double, 2> grid) {
  const Index rows = grid.extent(0);
  const Index columns = grid.extent(1);
  for (Index k = 0; k < static_cast<Index>(floes.radii.size()); ++k) {
    const Polygon outline = floes.outlines[k];
    const CellSpan extent = rows_of(outline);
    const double cost = floes.costs.totals[at(k)];
    if (cost == 0.0 || extent.high < 0.0 || extent.low > static_cast<double>(rows - 1)) continue;
    const Index first = ceil_index(extent.low);
    const Index last = floor_index(extent.high);
    const Vec2 centre = floes.centres[at(k)];
    const SpreadFloe floe(outline, centre, floes.radii[at(k)], weight);
    double total = 0.0;
    floe.cells(first, last, [&](Index, Index, double part) { total += part; });
    if (total == 0.0) {  // a sliver between the centres of cells
      const auto row = static_cast<Index>(std::rint(centre.x));
      const auto column = static_cast<Index>(std::rint(centre.y));
      if (0 <= row && row < rows && 0 <= column && column < columns) grid(row, column) += cost;
      continue;
    }
    const double scale = cost / total;
    floe.cells(std::max(first, Index{0}), std::min(last, rows - 1),
               [&](Index row, Index column, double part) {
                 if (0 <= column && column < columns) grid(row, column) += scale * part;
               });
  }
}

}  // namespace

CellSpan row_span(Polygon outline, double row) {
  CellSpan columns{kInfinity, -kInfinity};
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 p = outline[i];
    const Vec2 q = outline[i + 1 < outline.size() ? i + 1 : 0];
    const double a = p.x - row;
    const double b = q.x - row;
    if ((a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)) continue;
    if (a == b) {
      columns.low = std::min(std::min(columns.low, p.y), q.y);
      columns.high = std::max(std::max(columns.high, p.y), q.y);
      continue;
    }
    const double column = p.y + (q.y - p.y) * a / (a - b);
    columns.low = std::min(columns.low, column);
    columns.high = std::max(columns.high, column);
  }
  return columns;
}

void add_floes(const PlacedFloes& floes, ArrayView<double, 2> grid) {
  const double exponent = floes.costs.exponent;
  const double soft = floes.costs.soft;
  if (exponent == -0.5) {  // a power takes ten times as long
    add_weighted(floes, [soft](double q) { return 1.0 / std::sqrt(1.0 + soft - q); }, grid);
  } else if (exponent == 0.0) {
    add_weighted(floes, [](double) { return 1.0; }, grid);
  } else if (exponent == 1.0) {
    add_weighted(floes, [soft](double q) { return 1.0 + soft - q; }, grid);
  } else {
    add_weighted(floes, [=](double q) { return std::pow(1.0 + soft - q, exponent); }, grid);
  }
}

void block_cells(const Polygons& outlines, double margin, ArrayView<double, 2> grid) {
  const Index rows = grid.extent(0);
  const Index columns = grid.extent(1);
  for (Index s = 0; s < outlines.count(); ++s) {
    const Polygon outline = outlines[s];
    const CellSpan extent = rows_of(outline);
    const Index first = std::max(floor_index(extent.low - margin), Index{0});
    const Index last = std::min(ceil_index(extent.high + margin), rows - 1);
    for (Index row = first; row <= last; ++row) {
      const CellSpan near = columns_near(outline, static_cast<double>(row), margin);
      if (!(near.low <= near.high)) continue;
      const Index left = std::max(floor_index(near.low - margin), Index{0});
      const Index right = std::min(ceil_index(near.high + margin), columns - 1);
      for (Index column = left; column <= right; ++column) {
        if (near_outline(outline, static_cast<double>(row), static_cast<double>(column),
                         margin * margin)) {
          grid(row, column) = 1.0;
        }
      }
    }
  }
}

void prefix_sums(ArrayView<const double, 2> grid, ArrayView<double, 2> sums) {
  constexpr Index kTogether = 8;  // rows: near in memory on both sides
  const Index rows = grid.extent(0);
  const Index columns = grid.extent(1);
  for (Index column = 0; column < columns; ++column) sums(column, 0) = 0.0;
  for (Index top = 0; top < rows; top += kTogether) {
    const Index end = std::min(top + kTogether, rows);
    for (Index column = 0; column < columns; ++column) {
      double total = sums(column, top);
      for (Index row = top; row < end; ++row) {
        total += grid(row, column);
        sums(column, row + 1) = total;
      }
    }
  }
}

}  // namespace pushplan
