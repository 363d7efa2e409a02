// Convex polygons filled into images, one row of pixels at a time.
//
// Pixel coordinates: x to the right along columns, y down along rows; pixel (r, c) covers
// [c, c + 1] x [r, r + 1], so that its centre is at (c + 0.5, r + 0.5).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/array.hpp"
#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// The first and the last of `count` pixels in a row or a column whose centres are within `low` to
/// `high` [px]; the last comes before the first where there is none. The interval reaches into the
/// image.
struct PixelRange {
  Index first;
  Index last;
};

inline PixelRange pixels_between(double low, double high, Index count) {
  return {std::max(Index{0}, static_cast<Index>(std::ceil(std::max(low, 0.0) - 0.5))),
          std::min(count - 1, static_cast<Index>(std::floor(
                                  std::min(high, static_cast<double>(count)) - 0.5)))};
}

/// Sets the pixels whose centres are in a convex polygon with corners in pixel coordinates.
template <class T>
void fill_convex(ArrayView<T, 2> image, Polygon polygon, T value) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Index rows = image.extent(0);
  const Index cols = image.extent(1);
  double low = kInfinity;
  double high = -kInfinity;
  for (const Vec2 corner : polygon) {
    low = std::min(low, corner.y);
    high = std::max(high, corner.y);
  }
  if (!(low <= static_cast<double>(rows) && high >= 0.0)) return;  // NaN too
  const PixelRange down = pixels_between(low, high, rows);
  for (Index r = down.first; r <= down.last; ++r) {
    const double y = static_cast<double>(r) + 0.5;
    double left = kInfinity;
    double right = -kInfinity;
    Vec2 from = polygon.back();
    for (const Vec2 to : polygon) {
      const Vec2 before = from;
      from = to;
      if ((before.y < y && to.y < y) || (before.y > y && to.y > y)) continue;
      if (before.y == to.y) {
        left = std::min(left, std::min(before.x, to.x));
        right = std::max(right, std::max(before.x, to.x));
      } else {
        const double x = before.x + (to.x - before.x) * (y - before.y) / (to.y - before.y);
        left = std::min(left, x);
        right = std::max(right, x);
      }
    }
    if (right < 0.0 || left > static_cast<double>(cols)) continue;
    const PixelRange across = pixels_between(left, right, cols);
    for (Index c = across.first; c <= across.last; ++c) image(r, c) = value;
  }
}

}  // namespace pushplan
