// Convex polygons filled into images.
//
// Pixel coordinates: x to the right along columns, y down along rows; pixel (r, c) covers
// [c, c + 1] x [r, r + 1], so that its centre is at (c + 0.5, r + 0.5).
#pragma once

#include <algorithm>
#include <vector>

#include "pushplan/arithmetic.hpp"
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
  return {std::max(Index{0}, ceil_index(std::max(low, 0.0) - 0.5)),
          std::min(count - 1, floor_index(std::min(high, static_cast<double>(count)) - 0.5))};
}

/// Fills convex polygons into images; with memory, for one thread.
class ConvexFiller {
 public:
  /// Sets the pixels whose centres are in a polygon with corners in pixel coordinates.
  template <class T>
  void fill(ArrayView<T, 2> image, Polygon polygon, T value);

 private:
  /// What a row of pixel centres has in common with the polygon [px].
  struct Run {
    double left = kInfinity;
    double right = -kInfinity;

    void widen(double from, double to) {
      left = std::min(left, from);
      right = std::max(right, to);
    }
  };

  std::vector<Run> runs_;  // of the rows that the polygon reaches
};

template <class T>
void ConvexFiller::fill(ArrayView<T, 2> image, Polygon polygon, T value) {
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
  if (down.first > down.last) return;
  runs_.assign(static_cast<std::size_t>(down.last - down.first + 1), Run{});
  Vec2 to = polygon.back();
  for (const Vec2 corner : polygon) {
    const Vec2 from = to;
    to = corner;
    const double top = std::min(from.y, to.y);
    const double bottom = std::max(from.y, to.y);
    if (!(top <= static_cast<double>(rows) && bottom >= 0.0)) continue;
    const PixelRange crossed = pixels_between(top, bottom, rows);
    for (Index r = crossed.first; r <= crossed.last; ++r) {
      Run& run = runs_[static_cast<std::size_t>(r - down.first)];
      if (from.y == to.y) {
        run.widen(std::min(from.x, to.x), std::max(from.x, to.x));
      } else {
        const double y = static_cast<double>(r) + 0.5;
        const double x = from.x + (to.x - from.x) * (y - from.y) / (to.y - from.y);
        run.widen(x, x);
      }
    }
  }
  for (Index r = down.first; r <= down.last; ++r) {
    const Run& run = runs_[static_cast<std::size_t>(r - down.first)];
    if (run.right < 0.0 || run.left > static_cast<double>(cols)) continue;
    const PixelRange across = pixels_between(run.left, run.right, cols);
    if (across.first > across.last) continue;
    std::fill_n(&image(r, across.first), across.last - across.first + 1, value);
  }
}

}  // namespace pushplan
