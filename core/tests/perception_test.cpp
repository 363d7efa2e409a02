// Rays of a robot.
#include <array>
#include <cmath>
#include <numbers>

#include "check.hpp"
#include "pushplan/perception/rays.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

/// In the middle of a square, rays end on its sides; what is farther than their length is not seen.
void rays_end_on_outlines() {
  const Shapes square({rectangle(-2.0, -2.0, 2.0, 2.0)});
  std::array<double, 8> lengths;
  lengths.fill(10.0);
  cast_rays(lengths, {0.0, 0.0, 0.0}, square.polygons());
  for (std::size_t i = 0; i < 8; ++i) {
    CHECK(near_to(lengths[i], i % 2 == 0 ? 2.0 : 2.0 * std::numbers::sqrt2));
  }
  lengths.fill(1.5);
  cast_rays(lengths, {0.0, 0.0, 0.0}, square.polygons());
  for (const double length : lengths) CHECK(length == 1.5);
}

/// Each length is the least over the crossings with all edges.
void rays_are_as_short_as_their_crossings() {
  Xorshift64Star random(1);
  for (int trial = 0; trial < 100; ++trial) {
    Shapes outlines;
    for (int k = 0; k < 5; ++k) {
      const Vec2 centre{between(random, -3.0, 3.0), between(random, -3.0, 3.0)};
      outlines.add(convex_shape(random, centre, 0.8));
    }
    const Pose start = random_pose(random, 2.0);
    std::array<double, 36> lengths;
    lengths.fill(4.0);
    cast_rays(lengths, start, outlines.polygons());
    for (std::size_t i = 0; i < 36; ++i) {
      const double bearing = start.theta + 2.0 * std::numbers::pi * static_cast<double>(i) / 36.0;
      const double c = std::cos(bearing);
      const double s = std::sin(bearing);
      double least = 4.0;
      for (Index k = 0; k < 5; ++k) {
        const Polygon outline = outlines.polygons()[k];
        for (std::size_t e = 0; e < outline.size(); ++e) {
          const Vec2 a{outline[e].x - start.x, outline[e].y - start.y};
          const Vec2 next = outline[next_corner(outline, e)];
          const Vec2 b{next.x - start.x, next.y - start.y};
          const double left_a = c * a.y - s * a.x;
          const double left_b = c * b.y - s * b.x;
          if ((left_a > 0.0) == (left_b > 0.0)) continue;
          const double t = left_a / (left_a - left_b);
          const double away = c * (a.x + t * (b.x - a.x)) + s * (a.y + t * (b.y - a.y));
          if (away >= 0.0) least = std::min(least, away);
        }
      }
      CHECK(near_to(lengths[i], least, 1e-6));
    }
  }
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::rays_end_on_outlines();
  pushplan::rays_are_as_short_as_their_crossings();
  return pushplan::tests::finish();
}
