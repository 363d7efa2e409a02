#include "pushplan/observation/view.hpp"

#include "pushplan/geometry/raster.hpp"

namespace pushplan {
namespace {

/// The nearest of `count` cells; truncation rounds down what is not negative.
Index cell_at(double place, Index count) {
  return static_cast<Index>(std::min(std::max(0.0, place), static_cast<double>(count - 1)));
}

}  // namespace

void fill_parts(Image image, const ImageView& view, const Polygons& parts, std::uint8_t value) {
  std::vector<Vec2> spots(parts.vertices.size());
  to_pixels(view, parts.vertices, spots.data());
  const Polygons drawn{spots, parts.offsets};
  ConvexFiller filler;
  for (Index k = 0; k < drawn.count(); ++k) filler.fill(image, drawn[k], value);
}

void fill_bodies(Image image, const ImageView& view, std::span<const Pose> poses,
                 const Polygons& outlines, std::span<const double> radii, std::uint8_t value) {
  const double reach = 0.5 * std::hypot(view.rows * view.step_up, view.cols * view.step_across);
  std::vector<Vec2> corners(outlines.vertices.size());
  ConvexFiller filler;
  for (Index k = 0; k < static_cast<Index>(poses.size()); ++k) {
    const Pose& pose = poses[at(k)];
    const double far = reach + radii[at(k)];
    const double dx = pose.x - view.window.x;
    const double dy = pose.y - view.window.y;
    if (dx * dx + dy * dy > far * far) continue;
    const Polygon body = outlines[k];
    transform(pose, body, corners.data());
    const Polygon drawn(corners.data(), body.size());
    to_pixels(view, drawn, corners.data());
    filler.fill(image, drawn, value);
  }
}

void sample_raster(Image image, const ImageView& view, const Raster& raster) {
  const double c = std::cos(view.window.theta);
  const double s = std::sin(view.window.theta);
  const Index rows = raster.values.extent(0);
  const Index cols = raster.values.extent(1);
  const double up = view.step_up / raster.step;
  const double across = view.step_across / raster.step;
  // raster coordinates of the first pixel, and how they change along rows and columns
  const double front = 0.5 * (view.rows - 1.0) * up;
  const double left = 0.5 * (view.cols - 1.0) * across;
  const double u0 = (view.window.x - raster.origin.x) / raster.step + c * front - s * left;
  const double v0 = (view.window.y - raster.origin.y) / raster.step + s * front + c * left;
  for (Index r = 0; r < image.extent(0); ++r) {
    const double u = u0 - static_cast<double>(r) * up * c;
    const double v = v0 - static_cast<double>(r) * up * s;
    for (Index q = 0; q < image.extent(1); ++q) {
      const double aside = static_cast<double>(q) * across;
      image(r, q) = raster.values(cell_at(v - aside * c, rows), cell_at(u + aside * s, cols));
    }
  }
}

}  // namespace pushplan
