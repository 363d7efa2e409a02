// A lattice of poses over a static map, and which of them and of the moves between are free.
//
// Sixteen headings whose straight moves lead from cell to cell; the robot drives ahead or back
// along its heading, or turns to the next heading on the spot.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"
#include "pushplan/motion/collision.hpp"

namespace pushplan::rearrangement {

/// A straight move [cells].
struct GridMove {
  Index x;
  Index y;
};

inline constexpr std::size_t kHeadingCount = 16;

/// The move along each heading; a quarter of them, turned by right angles.
inline constexpr std::array<GridMove, kHeadingCount> kMoves = [] {
  constexpr std::array<GridMove, 4> kQuarter{{{1, 0}, {2, 1}, {1, 1}, {1, 2}}};
  std::array<GridMove, kHeadingCount> moves{};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto [x, y] = kQuarter[i];
    moves[i] = {x, y};
    moves[4 + i] = {-y, x};
    moves[8 + i] = {-x, -y};
    moves[12 + i] = {y, -x};
  }
  return moves;
}();

extern const std::array<double, kHeadingCount> kHeadings;  // [rad]
extern const std::array<double, kHeadingCount> kLengths;   // of the move along each [cells]
extern const std::array<double, kHeadingCount> kTurns;     // from each to the next [rad]

/// Cell (i, j) of the lattice has its middle at `origin + (j, i) * step`. Poses are counted heading
/// by heading, in each row by row.
struct PoseGrid {
  Vec2 origin;                       // [m]
  double step;                       // [m]
  ArrayView<const bool, 3> blocked;  // (16, rows, columns) where something static is in the way
  ArrayView<const bool, 4> blocked_moves;  // (2, 16, rows, columns) from where it is in the way of
                                           // the move ahead, and of the turn to the next heading

  Index rows() const { return blocked.extent(1); }
  Index columns() const { return blocked.extent(2); }
  double x(Index column) const { return origin.x + static_cast<double>(column) * step; }
  double y(Index row) const { return origin.y + static_cast<double>(row) * step; }
};

/// Writes at which poses a footprint touches an obstacle, as `PoseGrid.blocked`.
void block_poses(const PoseGrid& grid, CollisionChecker& checker, ArrayView<bool, 3> blocked);

/// Marks the moves between free poses on which it touches one, as `PoseGrid.blocked_moves`.
void block_moves(const PoseGrid& grid, CollisionChecker& checker, ArrayView<bool, 4> blocked_moves);

/// Numbers of poses, and what it costs to get there [m].
struct PoseCosts {
  std::vector<Index> nodes;
  std::vector<double> costs;
};

/// Free poses within `reach` [cells] of a pose, and the cost of going there.
PoseCosts near_poses(const PoseGrid& grid, const Pose& pose, double reach);

/// Writes how deep a footprint is in each of K objects [m]; `depths`, (K, 16, rows, columns), is 0
/// before.
void contact_depths(const PoseGrid& grid, const Footprint& footprint, std::span<const Pose> poses,
                    const Polygons& outlines,       // in their body frames
                    std::span<const double> radii,  // circumscribed [m]
                    ArrayView<float, 4> depths);

/// Adds up, for each pose, its depth in all objects of weight [m], and the weights of those it is
/// in. `depth` and `touch`, (16, rows, columns), are 0 before.
void add_layers(ArrayView<const float, 4> layers, std::span<const double> weights,
                ArrayView<double, 3> depth, ArrayView<double, 3> touch);

}  // namespace pushplan::rearrangement
