#include "pushplan/planners/rearrangement/pose_grid.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pushplan/arithmetic.hpp"
#include "pushplan/geometry/convex.hpp"

namespace pushplan::rearrangement {
namespace {

constexpr double kMaxStartTurn = 0.5;  // from a pose to the headings that are near it [rad]
constexpr Index kBlock = 64;  // poses that are passed over at once where none is in an object

template <class Value>
std::array<double, kHeadingCount> for_each_move(Value value) {
  std::array<double, kHeadingCount> values{};
  for (std::size_t t = 0; t < kHeadingCount; ++t) values[t] = value(t);
  return values;
}

double heading(std::size_t t) {
  return std::atan2(static_cast<double>(kMoves[t].y), static_cast<double>(kMoves[t].x));
}

double length(std::size_t t) {
  return std::hypot(static_cast<double>(kMoves[t].x), static_cast<double>(kMoves[t].y));
}

double turn_to_next(std::size_t t) {
  const double turn = heading((t + 1) % kHeadingCount) - heading(t);
  return std::abs(std::atan2(std::sin(turn), std::cos(turn)));
}

/// The rows or columns from `low` to `high` [cells].
struct Range {
  Index first;
  Index last;

  Index count() const { return std::max<Index>(0, last - first + 1); }
};

Range range(double low, double high, Index count) {
  return {std::max<Index>(0, static_cast<Index>(std::ceil(low))),
          std::min(count - 1, static_cast<Index>(std::floor(high)))};
}

/// True if one of `kBlock` depths is positive. Without branches, for vector instructions.
bool any_positive(const float* depths) {
  int found = 0;
  for (Index i = 0; i < kBlock; ++i) found |= static_cast<int>(depths[i] > 0.0F);
  return found != 0;
}

}  // namespace

const std::array<double, kHeadingCount> kHeadings = for_each_move(heading);
const std::array<double, kHeadingCount> kLengths = for_each_move(length);
const std::array<double, kHeadingCount> kTurns = for_each_move(turn_to_next);

void block_poses(const PoseGrid& grid, CollisionChecker& checker, ArrayView<bool, 3> blocked) {
  for (std::size_t t = 0; t < kHeadingCount; ++t) {
    for (Index i = 0; i < grid.rows(); ++i) {
      for (Index j = 0; j < grid.columns(); ++j) {
        blocked(t, i, j) = !checker.is_free({grid.x(j), grid.y(i), kHeadings[t]});
      }
    }
  }
}

namespace {

/// True if a straight move from a cell, with free ends, is not free.
bool move_is_blocked(const PoseGrid& grid, CollisionChecker& checker, std::size_t t, Index i,
                     Index j) {
  const auto [dx, dy] = kMoves[t];
  const auto between = static_cast<Index>(std::ceil(2.0 * kLengths[t]));
  const double parts = static_cast<double>(between);
  for (Index n = 1; n < between; ++n) {
    const double column = static_cast<double>(j) + static_cast<double>(dx * n) / parts;
    const double row = static_cast<double>(i) + static_cast<double>(dy * n) / parts;
    const Pose pose{grid.origin.x + column * grid.step, grid.origin.y + row * grid.step,
                    kHeadings[t]};
    if (!checker.is_free(pose)) return true;
  }
  return false;
}

/// The same of the turn to the next heading.
bool turn_is_blocked(const PoseGrid& grid, CollisionChecker& checker, std::size_t t, Index i,
                     Index j) {
  for (const double n : {1.0, 2.0}) {
    if (!checker.is_free({grid.x(j), grid.y(i), kHeadings[t] + kTurns[t] * n / 3.0})) return true;
  }
  return false;
}

}  // namespace

void block_moves(const PoseGrid& grid, CollisionChecker& checker,
                 ArrayView<bool, 4> blocked_moves) {
  const Index rows = grid.rows();
  const Index columns = grid.columns();
  for (std::size_t t = 0; t < kHeadingCount; ++t) {
    const std::size_t next = (t + 1) % kHeadingCount;
    const auto [dx, dy] = kMoves[t];
    for (Index i = 0; i < rows; ++i) {
      for (Index j = 0; j < columns; ++j) {
        if (grid.blocked(t, i, j)) continue;
        const bool inside = 0 <= i + dy && i + dy < rows && 0 <= j + dx && j + dx < columns;
        if (inside && !grid.blocked(t, i + dy, j + dx) && move_is_blocked(grid, checker, t, i, j)) {
          blocked_moves(0, t, i, j) = true;
        }
        if (!grid.blocked(next, i, j) && turn_is_blocked(grid, checker, t, i, j)) {
          blocked_moves(1, t, i, j) = true;
        }
      }
    }
  }
}

PoseCosts near_poses(const PoseGrid& grid, const Pose& pose, double reach) {
  constexpr double kPi = std::numbers::pi;
  const double u = (pose.x - grid.origin.x) / grid.step;
  const double v = (pose.y - grid.origin.y) / grid.step;
  const Range rows = range(v - reach, v + reach, grid.rows());
  const Range columns = range(u - reach, u + reach, grid.columns());
  PoseCosts found;
  for (std::size_t t = 0; t < kHeadingCount; ++t) {
    const double turn = std::abs(floor_mod(kHeadings[t] - pose.theta + kPi, 2.0 * kPi) - kPi);
    if (turn >= kMaxStartTurn) continue;
    for (Index i = rows.first; i <= rows.last; ++i) {
      for (Index j = columns.first; j <= columns.last; ++j) {
        const double away = std::hypot(static_cast<double>(i) - v, static_cast<double>(j) - u);
        if (away > reach || grid.blocked(t, i, j)) continue;
        found.nodes.push_back((static_cast<Index>(t) * grid.rows() + i) * grid.columns() + j);
        found.costs.push_back((away + 0.5 * turn) * grid.step);
      }
    }
  }
  return found;
}

void contact_depths(const PoseGrid& grid, const Footprint& footprint, std::span<const Pose> poses,
                    const Polygons& outlines, std::span<const double> radii,
                    ArrayView<float, 4> depths) {
  std::vector<Vec2> outline;
  std::vector<Vec2> moved;
  std::vector<Vec2> corners(footprint.parts.vertices.size());
  const Polygons parts{corners, footprint.parts.offsets};
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vec2 middle{poses[k].x, poses[k].y};
    const Polygon body = outlines[static_cast<Index>(k)];
    outline.resize(body.size());
    moved.resize(body.size());
    transform(poses[k], body, outline.data());
    const double reach = footprint.radius + radii[k];
    const Range rows = range((middle.y - reach - grid.origin.y) / grid.step,
                             (middle.y + reach - grid.origin.y) / grid.step, grid.rows());
    const Range columns = range((middle.x - reach - grid.origin.x) / grid.step,
                                (middle.x + reach - grid.origin.x) / grid.step, grid.columns());
    for (std::size_t t = 0; t < kHeadingCount; ++t) {
      transform({0.0, 0.0, kHeadings[t]}, footprint.parts.vertices, corners.data());
      for (Index i = rows.first; i <= rows.last; ++i) {
        const double y = grid.y(i);
        for (Index j = columns.first; j <= columns.last; ++j) {
          const double x = grid.x(j);
          const double dx = middle.x - x;
          const double dy = middle.y - y;
          if (dx * dx + dy * dy >= reach * reach || grid.blocked(t, i, j)) continue;
          for (std::size_t n = 0; n < outline.size(); ++n) {
            moved[n] = {outline[n].x - x, outline[n].y - y};
          }
          double deepest = 0.0;
          for (Index part = 0; part < parts.count(); ++part) {
            deepest = std::max(deepest, convex_penetration(parts[part], moved).depth);
          }
          depths(k, t, i, j) = static_cast<float>(deepest);
        }
      }
    }
  }
}

void add_layers(ArrayView<const float, 4> layers, std::span<const double> weights,
                ArrayView<double, 3> depth, ArrayView<double, 3> touch) {
  double* depths = depth.data();
  double* touched = touch.data();
  const Index size = depth.size();
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const double weight = weights[k];
    if (weight == 0.0) continue;
    const float* layer = layers.row(static_cast<Index>(k)).data();
    for (Index begin = 0; begin < size; begin += kBlock) {
      const Index end = std::min(begin + kBlock, size);
      if (end - begin == kBlock && !any_positive(layer + begin)) continue;
      for (Index n = begin; n < end; ++n) {
        if (layer[n] > 0.0F) {
          depths[n] += static_cast<double>(layer[n]);
          touched[n] += weight;
        }
      }
    }
  }
}

}  // namespace pushplan::rearrangement
