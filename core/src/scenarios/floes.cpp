#include "pushplan/scenarios/floes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "pushplan/geometry/polygon.hpp"

namespace pushplan {
namespace {

constexpr int kBisections = 24;
constexpr double kShortestEdge = 0.08;  // edge that is left out, in roots of the target area

std::size_t next(std::size_t i, std::size_t count) { return i + 1 < count ? i + 1 : 0; }

/// A convex polygon in a buffer, which is cut and thinned out in place.
class CutPolygon {
 public:
  explicit CutPolygon(std::span<Vec2> buffer) : corners_(buffer) {}

  std::size_t size() const { return count_; }
  Polygon polygon() const { return corners_.first(count_); }
  void clear() { count_ = 0; }
  void add(Vec2 corner) { corners_[count_++] = corner; }

  /// Cuts by the half plane u . p <= bound.
  void clip(Vec2 u, double bound) {
    const auto height = [&](Vec2 p) { return u.x * p.x + u.y * p.y; };
    const bool cuts = std::any_of(corners_.begin(), corners_.begin() + static_cast<Index>(count_),
                                  [&](Vec2 p) { return height(p) > bound; });
    if (!cuts) return;
    std::size_t kept = 0;
    const auto keep = [&](Vec2 p) {
      if (kept < spare_.size()) spare_[kept++] = p;
    };
    for (std::size_t i = 0; i < count_; ++i) {
      const Vec2 p = corners_[i];
      const Vec2 q = corners_[next(i, count_)];
      const double a = height(p) - bound;
      const double b = height(q) - bound;
      if (a <= 0.0) keep(p);
      if ((a < 0.0 && 0.0 < b) || (b < 0.0 && 0.0 < a)) {
        const double t = a / (a - b);
        keep({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)});
      }
    }
    std::copy_n(spare_.begin(), kept, corners_.begin());
    count_ = kept > 2 ? kept : 0;
  }

  /// Leaves out corners while an edge is shorter than `shortest` [m].
  void simplify(double shortest) {
    while (count_ > 3) {
      double best = shortest;
      std::size_t edge = count_;
      for (std::size_t i = 0; i < count_; ++i) {
        const Vec2 p = corners_[i];
        const Vec2 q = corners_[next(i, count_)];
        const double length = std::hypot(q.x - p.x, q.y - p.y);
        if (length < best) {
          best = length;
          edge = i;
        }
      }
      if (edge == count_) break;
      // of its two ends the one whose loss costs the smaller triangle
      const std::size_t after = next(edge, count_);
      const std::size_t out = loss(after) < loss(edge) ? after : edge;
      std::copy(corners_.begin() + static_cast<Index>(out) + 1,
                corners_.begin() + static_cast<Index>(count_),
                corners_.begin() + static_cast<Index>(out));
      --count_;
    }
  }

 private:
  /// Area [m^2] that the polygon loses with a corner.
  double loss(std::size_t i) const {
    const Vec2 before = corners_[i > 0 ? i - 1 : count_ - 1];
    const Vec2 after = corners_[next(i, count_)];
    const double ux = corners_[i].x - before.x;
    const double uy = corners_[i].y - before.y;
    const double vx = after.x - before.x;
    const double vy = after.y - before.y;
    return 0.5 * std::abs(ux * vy - uy * vx);
  }

  std::span<Vec2> corners_;
  std::size_t count_ = 0;
  std::array<Vec2, kFloeCorners> spare_;
};

/// Makes a scaled shape about a place within a convex cell.
void cut_out(Polygon shape, double scale, Vec2 centre, Polygon cell, CutPolygon& out) {
  out.clear();
  for (const Vec2 p : shape) out.add({centre.x + scale * p.x, centre.y + scale * p.y});
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Vec2 p = cell[i];
    const Vec2 q = cell[next(i, cell.size())];
    const double nx = q.y - p.y;
    const double ny = p.x - q.x;
    const double length = std::hypot(nx, ny);
    if (length == 0.0) continue;
    const Vec2 u{nx / length, ny / length};
    out.clip(u, u.x * p.x + u.y * p.y);
  }
}

/// Placed discs in the cells of a grid.
class Buckets {
 public:
  Buckets(Index rows, Index cols, std::span<const double> radii, std::span<Vec2> centres)
      : rows_(rows),
        cols_(cols),
        radii_(radii),
        centres_(centres),
        head_(at(rows * cols), -1),
        following_(centres.size(), -1) {}

  void put(Index k, Vec2 centre, Index row, Index col) {
    centres_[at(k)] = centre;
    Index& head = head_[at(row * cols_ + col)];
    following_[at(k)] = head;
    head = k;
  }

  /// True if a disc in a cell overlaps a placed one.
  bool touches(Vec2 p, double reach, Index row, Index col) const {
    for (Index r = std::max(Index{0}, row - 1); r < std::min(rows_, row + 2); ++r) {
      for (Index c = std::max(Index{0}, col - 1); c < std::min(cols_, col + 2); ++c) {
        for (Index k = head_[at(r * cols_ + c)]; k >= 0; k = following_[at(k)]) {
          const double dx = centres_[at(k)].x - p.x;
          const double dy = centres_[at(k)].y - p.y;
          const double far = reach + radii_[at(k)];
          if (dx * dx + dy * dy < far * far) return true;
        }
      }
    }
    return false;
  }

 private:
  Index rows_;
  Index cols_;
  std::span<const double> radii_;
  std::span<Vec2> centres_;
  std::vector<Index> head_;       // last disc in each cell, -1 for none
  std::vector<Index> following_;  // the one before it in the same cell
};

bool touches_block(Vec2 p, double reach, const Polygons& blocks) {
  for (Index b = 0; b < blocks.count(); ++b) {
    if (nearest_point(p, blocks[b]).distance < reach) return true;
  }
  return false;
}

/// Which of `count` cells a fraction falls into.
Index cell_of(double offset, double size, Index count) {
  const double place = offset / size * static_cast<double>(count);
  return static_cast<Index>(std::min(std::max(0.0, place), static_cast<double>(count - 1)));
}

}  // namespace

NearestPoint nearest_point(Vec2 p, Polygon polygon) {
  NearestPoint best{std::numeric_limits<double>::infinity(), p};
  bool inside = true;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i];
    const Vec2 b = polygon[next(i, polygon.size())];
    const double ex = b.x - a.x;
    const double ey = b.y - a.y;
    const double px = p.x - a.x;
    const double py = p.y - a.y;
    if (ex * py - ey * px < 0.0) inside = false;
    const double t = std::min(1.0, std::max(0.0, (ex * px + ey * py) / (ex * ex + ey * ey)));
    const Vec2 q{a.x + t * ex, a.y + t * ey};
    const double distance = std::hypot(p.x - q.x, p.y - q.y);
    if (distance < best.distance) best = {distance, q};
  }
  return inside ? NearestPoint{0.0, p} : best;
}

void cut_cells(const Discs& discs, const IceWater& water, const OutlinesOut& cells) {
  for (std::size_t k = 0; k < discs.centres.size(); ++k) {
    const Vec2 centre = discs.centres[k];
    const double reach = discs.reaches[k];
    const double x0 = std::max(water.x_min, centre.x - reach);
    const double y0 = std::max(water.y_min, centre.y - reach);
    const double x1 = std::min(water.x_max, centre.x + reach);
    const double y1 = std::min(water.y_max, centre.y + reach);
    CutPolygon cell(cells.corners.row(static_cast<Index>(k)));
    cell.add({x0, y0});
    cell.add({x1, y0});
    cell.add({x1, y1});
    cell.add({x0, y1});
    for (Index i = discs.neighbour_offsets[k]; i < discs.neighbour_offsets[k + 1]; ++i) {
      const std::size_t other = at(discs.neighbours[at(i)]);
      const double dx = discs.centres[other].x - centre.x;
      const double dy = discs.centres[other].y - centre.y;
      const double far = std::hypot(dx, dy);
      const double power =
          discs.radii[k] * discs.radii[k] - discs.radii[other] * discs.radii[other];
      const double away = 0.5 * (far + power / far - water.gap);
      const Vec2 u{dx / far, dy / far};
      cell.clip(u, u.x * centre.x + u.y * centre.y + away);
    }
    for (Index b = 0; b < water.blocks.count(); ++b) {
      const NearestPoint nearest = nearest_point(centre, water.blocks[b]);
      if (nearest.distance == 0.0) {
        cell.clear();
        break;
      }
      const Vec2 u{(nearest.point.x - centre.x) / nearest.distance,
                   (nearest.point.y - centre.y) / nearest.distance};
      cell.clip(u, u.x * nearest.point.x + u.y * nearest.point.y - water.gap);
    }
    cells.counts[k] = static_cast<Index>(cell.size());
  }
}

void fit_floes(const Outlines& shapes, std::span<const Vec2> centres, const Outlines& cells,
               std::span<const double> targets, double stretch, const OutlinesOut& floes) {
  for (std::size_t k = 0; k < centres.size(); ++k) {
    const auto row = static_cast<Index>(k);
    floes.counts[k] = 0;
    if (cells.counts[k] == 0) continue;
    CutPolygon floe(floes.corners.row(row));
    const auto grow = [&](double scale) {
      cut_out(shapes[row], scale, centres[k], cells[row], floe);
      return floe.size() > 0 && polygon_area(floe.polygon()) >= targets[k];
    };
    const double unit = std::sqrt(targets[k]);
    double low = unit;
    double high = unit;
    if (!grow(unit)) high = stretch * unit;
    if (high > low) {
      for (int i = 0; i < kBisections; ++i) {
        const double middle = 0.5 * (low + high);
        (grow(middle) ? high : low) = middle;
      }
    }
    grow(high);
    floe.simplify(kShortestEdge * unit);
    floes.counts[k] = static_cast<Index>(floe.size());
  }
}

Index place_discs(std::span<const double> radii, ArrayView<const double, 3> draws,
                  ArrayView<const double, 2> density, const IceWater& water,
                  std::span<Vec2> centres) {
  const Index count = draws.extent(0);
  const Index tries = draws.extent(1);
  const double width = water.x_max - water.x_min;
  const double height = water.y_max - water.y_min;
  const double side = 2.0 * radii[0] + water.gap;
  const Index cols = std::max(Index{1}, static_cast<Index>(width / side));
  const Index rows = std::max(Index{1}, static_cast<Index>(height / side));
  Buckets buckets(rows, cols, radii, centres);
  for (Index k = 0; k < count; ++k) {
    const double r = radii[at(k)];
    const double reach = r + water.gap;
    bool done = false;
    for (Index t = 0; t < tries && !done; ++t) {
      const Vec2 p{water.x_min + r + draws(k, t, 0) * std::max(0.0, width - 2.0 * r),
                   water.y_min + r + draws(k, t, 1) * std::max(0.0, height - 2.0 * r)};
      const double across = p.x - water.x_min;
      const double up = p.y - water.y_min;
      const double chance = density(cell_of(up, height, density.extent(0)),
                                    cell_of(across, width, density.extent(1)));
      // the second half of the draws of a disc takes any place
      if (2 * t < tries && draws(k, t, 2) > chance) continue;
      const Index col = cell_of(across, width, cols);
      const Index row = cell_of(up, height, rows);
      if (buckets.touches(p, reach, row, col) || touches_block(p, reach, water.blocks)) continue;
      buckets.put(k, p, row, col);
      done = true;
    }
    if (!done) return k;
  }
  return count;
}

}  // namespace pushplan
