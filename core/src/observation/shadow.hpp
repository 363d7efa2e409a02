// Shadows of convex polygons in images. Shadows of convex shapes are convex, so they are filled like
// any other polygon instead of being tested pixel by pixel.
#pragma once

#include <cmath>
#include <vector>

#include "../local_geometry.hpp"

namespace pushplan::local {

/// A viewpoint this close to a side or a corner is on it [px].
inline constexpr double kTouch = 1e-6;

/// The two corners of a convex polygon between which a viewpoint sees it; -1 from inside.
struct Outermost {
  Index first = -1;
  Index last = -1;
};

inline Outermost outermost(Vec2 eye, Polygon polygon) {
  Outermost found;
  bool left = false;
  bool right = false;
  bool shared = false;
  Vec2 a{0.0, 0.0};
  Vec2 b{0.0, 0.0};
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t j = i + 1 < polygon.size() ? i + 1 : 0;
    const Vec2 d{polygon[i].x - eye.x, polygon[i].y - eye.y};
    const Vec2 e{polygon[j].x - eye.x, polygon[j].y - eye.y};
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

/// Fills a convex polygon [px] and all that it hides from a viewpoint; nothing from inside. `hull` is
/// working memory.
template <class T>
void fill_shadow(ArrayView<T, 2> image, Vec2 eye, Polygon polygon, T value,
                 std::vector<Vec2>& hull) {
  const auto [first, last] = outermost(eye, polygon);
  if (first < 0) return;
  const Vec2 from = polygon[static_cast<std::size_t>(first)];
  const Vec2 to = polygon[static_cast<std::size_t>(last)];
  const double ax = from.x - eye.x;
  const double ay = from.y - eye.y;
  const double bx = to.x - eye.x;
  const double by = to.y - eye.y;
  const double far = 4.0 * (static_cast<double>(image.extent(0) + image.extent(1)) +
                            std::abs(eye.x) + std::abs(eye.y));
  const double a = far / std::hypot(ax, ay);
  const double b = far / std::hypot(bx, by);
  double mx = ax * a + bx * b;
  double my = ay * a + by * b;
  double size = std::hypot(mx, my);
  if (size < 1e-3 * far) {  // seen from one of its sides: the way across it
    double across = 0.0;
    for (const Vec2 p : polygon) {
      const double side = ax * (p.y - eye.y) - ay * (p.x - eye.x);
      if (std::abs(side) > std::abs(across)) across = side;
    }
    const double turn = across > 0.0 ? 1.0 : -1.0;
    mx = -turn * ay;
    my = turn * ax;
    size = std::hypot(ax, ay);
  }
  // all corners, then out along one edge of the shadow and back along the other; what lies inside
  // the hull of these does not change which pixels are filled
  hull.clear();
  for (std::size_t i = 0; i <= polygon.size(); ++i) {
    hull.push_back(polygon[(static_cast<std::size_t>(first) + i) % polygon.size()]);
  }
  hull.push_back({eye.x + ax * a, eye.y + ay * a});
  hull.push_back({eye.x + mx * far / size, eye.y + my * far / size});
  hull.push_back({eye.x + bx * b, eye.y + by * b});
  hull.push_back(to);
  fill_convex(image, Polygon(hull), value);
}

}  // namespace pushplan::local
