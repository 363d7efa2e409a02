// Places and headings joined by motion primitives, which cost what they cover.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "pushplan/array.hpp"

namespace pushplan {

/// Where a robot's origin is along a primitive, in rows and columns from its start.
struct OriginBox {
  double row_min;
  double row_max;
  double column_min;
  double column_max;
};

/// Where a primitive leads to.
struct PrimitiveEnd {
  Index rows;     // [steps]
  Index columns;  // [steps]
  Index heading;
};

/// Cells of one column that a primitive newly covers, as offsets in flattened sums.
struct SwathRun {
  Index first;
  Index end;  // last cell + 1
};

/// A half plane in which the robot's origin stays: a u + b v <= c [steps].
struct OriginLimit {
  double a;
  double b;
  double c;
};

/// The sum of a map over some runs around the cell at the offset `at`.
inline double swath_sum(std::span<const double> sums, std::span<const SwathRun> runs, Index at) {
  double total = 0.0;
  for (const SwathRun run : runs) {
    total += sums[static_cast<std::size_t>(at + run.end)] -
             sums[static_cast<std::size_t>(at + run.first)];
  }
  return total;
}

/// True if a path with its origin in `box` around (u, v) keeps to all half planes.
inline bool within(std::span<const OriginLimit> planes, Index u, Index v, const OriginBox& box) {
  for (const OriginLimit& plane : planes) {
    double worst = plane.a * (static_cast<double>(u) + (plane.a > 0.0 ? box.row_max : box.row_min));
    worst += plane.b * (static_cast<double>(v) + (plane.b > 0.0 ? box.column_max : box.column_min));
    if (worst > plane.c) return false;
  }
  return true;
}

/// A goal on a lattice: the rows from a line on, or a disc.
struct LatticeGoal {
  bool is_line;
  double row;     // of the line, or of the centre of the disc
  double column;  // of the centre
  double radius;  // [steps]
};

/// A lattice of H headings over rows ahead and columns across it, for `AStar`. Node (h, u, v) has
/// the number (h * rows + u) * columns + v. Lengths are in metres and places in steps, unless
/// stated otherwise; costs are in metres of travel.
struct PoseLattice {
  Index rows;
  Index columns;
  double step;       // distance of neighbouring places [m]
  Index cells;       // cells of the map in a step
  Index corner_row;  // cell of the map on which the node of row 0 and column 0 lies
  Index corner_column;
  std::span<const Index> first;        // (H + 1,) where the primitives of each heading start
  std::span<const PrimitiveEnd> ends;  // (P,)
  std::span<const double> lengths;     // (P,) [m]
  std::span<const OriginBox> boxes;    // (P,)
  std::span<const Index> run_first;    // (P + 1,) where the runs of each primitive start
  std::span<const SwathRun> runs;      // the map is so large that no swath leaves it
  std::span<const double> cost_sums;   // (map columns * (map rows + 1),) sums of the costs of each
                                       // column before each row [m]
  std::span<const double> blocked_sums;  // the same for cells that must not be covered; empty where
                                         // there are none
  Index stride;                          // map rows + 1
  std::span<const OriginLimit> planes;
  LatticeGoal goal;
  ArrayView<const double, 2> row_bounds;   // (H, rows) length of the path from each row and heading
                                           // to the line [m]
  ArrayView<const double, 2> place_costs;  // (rows, columns) bound or estimate of the cost from
                                           // each place to the line [m]
  double inflation;                        // factor on both

  struct Place {
    Index heading;
    Index row;
    Index column;
  };

  Place place_of(Index node) const {
    const Index rest = node / columns;
    return {rest / rows, rest % rows, node % columns};
  }

  std::span<const SwathRun> runs_of(Index primitive) const {
    const auto p = static_cast<std::size_t>(primitive);
    return runs.subspan(static_cast<std::size_t>(run_first[p]),
                        static_cast<std::size_t>(run_first[p + 1] - run_first[p]));
  }

  /// Length plus cost of a primitive from a place [m]; infinite where it is closed.
  double edge_cost(Index u, Index v, Index primitive) const {
    const Index at = (corner_column + v * cells) * stride + (corner_row + u * cells);
    const auto covered = runs_of(primitive);
    if (!blocked_sums.empty() && swath_sum(blocked_sums, covered, at) > 0.5) {
      return std::numeric_limits<double>::infinity();
    }
    return lengths[static_cast<std::size_t>(primitive)] + swath_sum(cost_sums, covered, at);
  }

  template <class Visit>
  void expand(Index node, Visit&& visit) const {
    const auto [h, u, v] = place_of(node);
    const Index end = first[static_cast<std::size_t>(h) + 1];
    for (Index primitive = first[static_cast<std::size_t>(h)]; primitive < end; ++primitive) {
      const auto p = static_cast<std::size_t>(primitive);
      const auto [du, dv, heading] = ends[p];
      const Index to_u = u + du;
      const Index to_v = v + dv;
      if (to_u < 0 || to_u >= rows || to_v < 0 || to_v >= columns) continue;
      if (!within(planes, u, v, boxes[p])) continue;
      double cost = edge_cost(u, v, primitive);
      if (cost == std::numeric_limits<double>::infinity()) continue;
      const double beyond = static_cast<double>(to_u) - goal.row;
      if (goal.is_line && beyond > 0.0) {
        const double straight = std::sqrt(static_cast<double>(du * du + dv * dv)) * step;
        // a line is driven only as far as the goal
        if (lengths[p] < 1.000001 * straight) cost -= lengths[p] * beyond / static_cast<double>(du);
      }
      visit((heading * rows + to_u) * columns + to_v, cost, primitive);
    }
  }

  /// Bound or estimate of the cost from a node to the goal [m], times the inflation.
  double estimate(Index node) const {
    const auto [h, u, v] = place_of(node);
    if (goal.is_line) return inflation * std::max(row_bounds(h, u), place_costs(u, v));
    const double gap = std::sqrt(square_to_centre(u, v)) - goal.radius;
    return inflation * std::max(0.0, gap) * step;
  }

  bool is_goal(Index node) const {
    const Place place = place_of(node);
    if (goal.is_line) return static_cast<double>(place.row) >= goal.row - 1e-9;
    return square_to_centre(place.row, place.column) <= goal.radius * goal.radius + 1e-9;
  }

  /// Squared distance of a place to the centre of the goal [steps^2].
  double square_to_centre(Index u, Index v) const {
    const double du = static_cast<double>(u) - goal.row;
    const double dv = static_cast<double>(v) - goal.column;
    return du * du + dv * dv;
  }
};

}  // namespace pushplan
