#include "pushplan/interaction/occupancy.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "pushplan/arithmetic.hpp"
#include "pushplan/geometry/raster.hpp"

namespace pushplan {
namespace {

constexpr Index kSubcells = 4;  // samples along each side of a cell: coverage in steps of 1/16

/// The samples of a raster, which are covered or not.
class Samples {
 public:
  Samples(const RasterFrame& frame, Coverage out)
      : frame_(frame),
        scale_(static_cast<double>(kSubcells) / frame.cell),
        rows_(kSubcells * out.extent(0)),
        columns_(kSubcells * out.extent(1)),
        covered_(static_cast<std::size_t>(rows_ * columns_), 0) {}

  /// Covers what lies in one of some outlines of the world, whose corners are changed.
  void cover(std::span<Vec2> corners, std::span<const Index> offsets) {
    const double c = std::cos(frame_.corner.theta);
    const double s = std::sin(frame_.corner.theta);
    for (Vec2& corner : corners) {
      const double dx = corner.x - frame_.corner.x;
      const double dy = corner.y - frame_.corner.y;
      corner = {scale_ * (c * dx + s * dy), scale_ * (c * dy - s * dx)};
    }
    const Polygons outlines{corners, offsets};
    const ArrayView<std::uint8_t, 2> image(covered_.data(), {rows_, columns_});
    for (Index k = 0; k < outlines.count(); ++k) {
      filler_.fill(image, outlines[k], std::uint8_t{1});
    }
  }

  /// Writes the mean of the samples of each cell.
  void average(Coverage out) const {
    for (Index r = 0; r < out.extent(0); ++r) {
      for (Index c = 0; c < out.extent(1); ++c) {
        int total = 0;
        for (Index i = 0; i < kSubcells; ++i) {
          const auto* row = covered_.data() + (kSubcells * r + i) * columns_ + kSubcells * c;
          for (Index j = 0; j < kSubcells; ++j) total += row[j];
        }
        out(r, c) = static_cast<float>(static_cast<double>(total) /
                                       static_cast<double>(kSubcells * kSubcells));
      }
    }
  }

 private:
  RasterFrame frame_;
  double scale_;  // samples per metre
  Index rows_;
  Index columns_;
  std::vector<std::uint8_t> covered_;
  ConvexFiller filler_;
};

}  // namespace

void cover_objects(std::span<const Pose> poses, const Polygons& outlines, const RasterFrame& frame,
                   Coverage out) {
  Samples samples(frame, out);
  std::vector<Vec2> corners(outlines.vertices.size());
  transform(poses, outlines, corners.data());
  samples.cover(corners, outlines.offsets);
  samples.average(out);
}

void cover_sweep(std::span<const Pose> path, const Polygons& robot, const RasterFrame& frame,
                 Coverage out) {
  Samples samples(frame, out);
  std::vector<Vec2> corners(robot.vertices.size());
  double reach = 0.0;
  for (const Vec2 corner : robot.vertices) {
    reach = std::max(reach, std::hypot(corner.x, corner.y));
  }
  for (std::size_t n = 0; n < path.size(); ++n) {
    const Pose& to = path[n];
    const Pose& from = path[n > 0 ? n - 1 : 0];
    const double turn = n > 0 ? wrap_angle(to.theta - from.theta) : 0.0;
    Index steps = 1;
    if (n > 0) {
      const double length = std::hypot(to.x - from.x, to.y - from.y);
      steps =
          std::max(Index{1}, ceil_index((length + std::abs(turn) * reach) / (0.5 * frame.cell)));
    }
    for (Index step = 0; step < steps; ++step) {
      const double back = static_cast<double>(step) / static_cast<double>(steps);
      const Pose pose{to.x - back * (to.x - from.x), to.y - back * (to.y - from.y),
                      to.theta - back * turn};
      transform(pose, robot.vertices, corners.data());
      samples.cover(corners, robot.offsets);
    }
  }
  samples.average(out);
}

}  // namespace pushplan
