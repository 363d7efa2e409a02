// The window that an image observation looks through, and what is drawn into the image.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

using Image = ArrayView<std::uint8_t, 2>;

/// A window on the world: where the pixels of an image are.
struct ImageView {
  Pose window;     // its middle, and the direction that is up in the image; left in the image is a
                   // quarter turn counter-clockwise from it
  double rows;     // [px]
  double cols;     // [px]
  double step_up;  // length of a pixel up the image [m]
  double step_across;  // length of a pixel across it [m]
};

/// Carries points of the world [m] to columns (x) and rows (y) [px].
inline void to_pixels(const ImageView& view, std::span<const Vec2> points, Vec2* out) {
  const double c = std::cos(view.window.theta);
  const double s = std::sin(view.window.theta);
  for (const Vec2 p : points) {
    const double dx = p.x - view.window.x;
    const double dy = p.y - view.window.y;
    *out++ = {0.5 * view.cols - (c * dy - s * dx) / view.step_across,
              0.5 * view.rows - (c * dx + s * dy) / view.step_up};
  }
}

/// Fills convex polygons of the world frame.
void fill_parts(Image image, const ImageView& view, const Polygons& parts, std::uint8_t value);

/// Fills the outlines, given in body frames, of the bodies that the window may show.
void fill_bodies(Image image, const ImageView& view, std::span<const Pose> poses,
                 const Polygons& outlines,
                 std::span<const double> radii,  // circumscribed [m]
                 std::uint8_t value);

/// Values of square cells.
struct Raster {
  ArrayView<const std::uint8_t, 2> values;
  Vec2 origin;  // its first corner [m]
  double step;  // side of a cell [m]
};

/// Reads a raster at every pixel, beyond its edges the nearest cell.
void sample_raster(Image image, const ImageView& view, const Raster& raster);

}  // namespace pushplan
