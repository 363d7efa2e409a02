// Rays of a robot.
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "check.hpp"
#include "pushplan/perception/rays.hpp"
#include "pushplan/perception/scan_marking.hpp"
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

/// A beam clears the cells that it passes and ends in one; what is beside that one stays as it is.
void scans_clear_and_fill_cells() {
  for (const double x : {4.5, 5.0}) {  // in a cell, and between two of them
    for (const double bearing : {0.0, std::numbers::pi}) {
      std::vector<double> values(10 * 3, 0.0);
      const LogOdds map{{values.data(), {3, 10}}, {0.0, 0.0}, 1.0};
      const std::array<double, 1> bearings{bearing};
      const std::array<double, 1> passed{3.2};
      mark_scan(map, {x, 1.5}, bearings, passed, passed, {1.5, -0.4, -2.0, 4.5, false});
      const double sign = bearing == 0.0 ? 1.0 : -1.0;
      const auto end = static_cast<Index>(std::floor(x + 3.2 * sign));
      CHECK(map.values(1, end) == 1.5);
      const auto first = static_cast<Index>(std::floor(x + 0.1 * sign));
      for (Index column = 0; column < 10; ++column) {
        CHECK(map.values(0, column) == 0.0);
        const Index along = sign > 0.0 ? column - first : first - column;
        const Index last = sign > 0.0 ? end - first : first - end;
        const bool free = 0 <= along && along < last - 1;
        if (column != end) CHECK(map.values(1, column) == (free ? -0.4 : 0.0));
      }
    }
  }
}

/// With noise a cell gets the mean of its beams; where beams end far off the map, nothing is hit.
void noisy_cells_get_the_mean() {
  std::vector<double> values(10 * 3, 0.0);
  const LogOdds map{{values.data(), {3, 10}}, {0.0, 0.0}, 1.0};
  const std::array<double, 4> bearings{0.0, 0.0, 0.0, std::numbers::pi};
  const std::array<double, 4> passed{3.2, 1e300, 3.2, 0.0};
  const std::array<double, 4> hits{3.2, 1e300, 3.2, 1e300};
  const ScanEvidence evidence{1.5, -0.4, -2.0, 4.5, true};
  const CellWindow window = mark_scan(map, {4.5, 1.5}, bearings, passed, hits, evidence);
  CHECK(near_to(map.values(1, 7), (2.0 * 1.5 - 3.0 * 0.4) / 5.0, 1e-12));
  CHECK(near_to(map.values(1, 9), -0.4, 1e-12) && map.values(1, 3) == 0.0);
  CHECK(window.row <= 1 && window.end_row >= 2 && window.column <= 4 && window.end_column == 10);
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::rays_end_on_outlines();
  pushplan::rays_are_as_short_as_their_crossings();
  pushplan::scans_clear_and_fill_cells();
  pushplan::noisy_cells_get_the_mean();
  return pushplan::tests::finish();
}
