#include "pushplan/geometry/shadows.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

constexpr double kTouch = 1e-6;  // a viewpoint this close to a side or a corner is on it [px]
constexpr Index kInside = -1;

/// The corners of a convex polygon between which a viewpoint sees it; `kInside` from inside.
struct Silhouette {
  Index first = kInside;
  Index last = kInside;
};

Silhouette outermost(Vec2 eye, Polygon corners) {
  Silhouette found;
  bool left = false;
  bool right = false;
  bool shared = false;  // the eye is on a corner
  Vec2 a{0.0, 0.0};     // from the eye to the first corner, and to the last
  Vec2 b{0.0, 0.0};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::size_t j = next_corner(corners, i);
    const Vec2 d{corners[i].x - eye.x, corners[i].y - eye.y};
    const Vec2 e{corners[j].x - eye.x, corners[j].y - eye.y};
    const double side = d.x * e.y - d.y * e.x;
    if (d.x * e.x + d.y * e.y < 0.0 &&
        std::abs(side) <= kTouch * std::hypot(e.x - d.x, e.y - d.y)) {
      return {static_cast<Index>(i), static_cast<Index>(j)};  // on this side
    }
    left = left || side > 0.0;
    right = right || side < 0.0;
    if (d.x * d.x + d.y * d.y <= kTouch * kTouch) {
      shared = true;
      continue;
    }
    if (found.first < 0 || a.x * d.y - a.y * d.x > 0.0) {
      found.first = static_cast<Index>(i);
      a = d;
    }
    if (found.last < 0 || b.x * d.y - b.y * d.x < 0.0) {
      found.last = static_cast<Index>(i);
      b = d;
    }
  }
  if (!shared && !(left && right)) return {};
  return found;
}

}  // namespace

ShadowPainter::ShadowPainter(const Polygons& polygons) : polygons_(polygons) {
  std::size_t most = 0;
  for (Index k = 0; k < polygons.count(); ++k) most = std::max(most, polygons[k].size());
  hull_.reserve(most + 5);
}

void ShadowPainter::fill(ArrayView<std::uint8_t, 2> mask, Vec2 eye, std::uint8_t value) {
  for (Index k = 0; k < polygons_.count(); ++k) fill_one(mask, eye, polygons_[k], value);
}

void ShadowPainter::fill_one(ArrayView<std::uint8_t, 2> mask, Vec2 eye, Polygon corners,
                             std::uint8_t value) {
  const Silhouette seen = outermost(eye, corners);
  if (seen.first < 0) return;
  const auto first = static_cast<std::size_t>(seen.first);
  const auto last = static_cast<std::size_t>(seen.last);
  const double ax = corners[first].x - eye.x;
  const double ay = corners[first].y - eye.y;
  const double bx = corners[last].x - eye.x;
  const double by = corners[last].y - eye.y;
  const double far = 4.0 * (static_cast<double>(mask.extent(0) + mask.extent(1)) + std::abs(eye.x) +
                            std::abs(eye.y));
  const double a = far / std::hypot(ax, ay);
  const double b = far / std::hypot(bx, by);
  // the direction of the middle of the shadow
  double mx = ax * a + bx * b;
  double my = ay * a + by * b;
  double size = std::hypot(mx, my);
  if (size < 1e-3 * far) {  // seen from one of its sides: the way across it
    double across = 0.0;
    for (const Vec2 corner : corners) {
      const double side = ax * (corner.y - eye.y) - ay * (corner.x - eye.x);
      if (std::abs(side) > std::abs(across)) across = side;
    }
    const double turn = across > 0.0 ? 1.0 : -1.0;
    mx = -turn * ay;
    my = turn * ax;
    size = std::hypot(ax, ay);
  }
  // all corners, then out along one edge of the shadow and back along the other; what lies inside
  // the hull of these does not change which pixels are filled
  hull_.clear();
  for (std::size_t i = 0; i <= corners.size(); ++i) {
    hull_.push_back(corners[(first + i) % corners.size()]);
  }
  hull_.push_back({eye.x + ax * a, eye.y + ay * a});
  hull_.push_back({eye.x + mx * far / size, eye.y + my * far / size});
  hull_.push_back({eye.x + bx * b, eye.y + by * b});
  hull_.push_back(corners[last]);
  filler_.fill(mask, Polygon(hull_), value);
}

void fill_bend_distances(ArrayView<float, 3> table, const Cells& cells, const Bends& bends,
                         ArrayView<const double, 2> between, const Polygons& outlines, double gap) {
  const Index rows = table.extent(0);
  const Index cols = table.extent(1);
  const Index count = table.extent(2);
  const auto bend_count = static_cast<std::size_t>(count);
  const auto pixel = [&](Vec2 p) {
    return Vec2{(p.x - cells.origin.x) / cells.step, (p.y - cells.origin.y) / cells.step};
  };
  std::vector<Vec2> spots(outlines.vertices.size());
  std::transform(outlines.vertices.begin(), outlines.vertices.end(), spots.begin(), pixel);
  std::vector<Vec2> eyes(bend_count);
  std::transform(bends.points.begin(), bends.points.end(), eyes.begin(), pixel);
  std::vector<std::uint8_t> memory(bend_count * static_cast<std::size_t>(rows * cols), 0);
  const ArrayView<std::uint8_t, 3> hidden(memory.data(), {count, rows, cols});
  ShadowPainter painter({spots, outlines.offsets});
  for (std::size_t k = 0; k < bend_count; ++k) {
    painter.fill(hidden.row(static_cast<Index>(k)), eyes[k], 1);
  }
  std::vector<double> best(bend_count);
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < cols; ++j) {
      std::fill(best.begin(), best.end(), kInfinity);
      for (std::size_t k = 0; k < bend_count; ++k) {
        const double dx = (static_cast<double>(j) + 0.5 - eyes[k].x) * cells.step;
        const double dy = (static_cast<double>(i) + 0.5 - eyes[k].y) * cells.step;
        if (hidden(k, i, j) || !bends.tangent({dx, dy}, k, gap)) continue;
        const double length = std::sqrt(dx * dx + dy * dy);
        const auto onwards = between.row(static_cast<Index>(k));
        for (std::size_t m = 0; m < bend_count; ++m) {
          best[m] = std::min(best[m], length + onwards[m]);
        }
      }
      for (std::size_t m = 0; m < bend_count; ++m) table(i, j, m) = static_cast<float>(best[m]);
    }
  }
}

BendsInSight bends_in_sight(Vec2 p, const Bends& bends, const Obstacles& obstacles, double gap,
                            double sliver) {
  BendsInSight found;
  const double clearance = obstacle_distance(p, obstacles);
  for (std::size_t k = 0; k < bends.points.size(); ++k) {
    const Vec2 q = bends.points[k];
    const double dx = p.x - q.x;
    const double dy = p.y - q.y;
    if (clearance > sliver && !bends.tangent({dx, dy}, k, gap)) continue;
    if (!line_of_sight(p, q, obstacles, gap)) continue;
    found.bends.push_back(static_cast<Index>(k));
    found.lengths.push_back(std::hypot(dx, dy));
  }
  return found;
}

}  // namespace pushplan
