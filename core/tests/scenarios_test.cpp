// Steps of the ice generator: nothing overlaps, all of it in the water.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "check.hpp"
#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/polygon.hpp"
#include "pushplan/scenarios/floes.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

constexpr std::size_t kDiscs = 30;
constexpr double kGap = 0.05;

/// K outlines in buffers of their own.
struct OwnedOutlines {
  OutlinesOut out() { return {{corners.data(), {kDiscs, kFloeCorners}}, counts}; }
  Outlines view() const { return {{corners.data(), {kDiscs, kFloeCorners}}, counts}; }

  std::vector<Vec2> corners = std::vector<Vec2>(kDiscs * kFloeCorners);
  std::vector<Index> counts = std::vector<Index>(kDiscs, 0);
};

/// Discs, their cells and the floes in them keep their distances.
void floes_keep_apart() {
  Xorshift64Star random(1);
  const Shapes blocks({rectangle(4.0, 4.0, 6.0, 6.0)});
  const IceWater water{0.0, 0.0, 10.0, 10.0, blocks.polygons(), kGap};
  std::vector<double> radii;
  for (std::size_t k = 0; k < kDiscs; ++k) radii.push_back(between(random, 0.2, 0.6));
  std::sort(radii.rbegin(), radii.rend());
  std::vector<double> draws(kDiscs * 200 * 3);
  for (double& draw : draws) draw = random.uniform();
  const std::vector<double> density(4, 0.5);
  std::vector<Vec2> centres(kDiscs);
  const Index count = place_discs(radii, {draws.data(), {kDiscs, 200, 3}}, {density.data(), {2, 2}},
                                  water, centres);
  CHECK(count == kDiscs);
  for (std::size_t k = 0; k < kDiscs; ++k) {
    const Vec2 p = centres[k];
    CHECK(std::min(std::min(p.x, p.y), 10.0 - std::max(p.x, p.y)) >= radii[k] - 1e-9);
    CHECK(nearest_point(p, blocks.polygons()[0]).distance >= radii[k] + kGap - 1e-9);
    for (std::size_t other = 0; other < k; ++other) {
      const double away = std::hypot(p.x - centres[other].x, p.y - centres[other].y);
      CHECK(away >= radii[k] + radii[other] + kGap - 1e-9);
    }
  }
  const std::vector<double> reaches(kDiscs, 1.5);
  std::vector<Index> neighbours;
  std::vector<Index> offsets{0};
  for (std::size_t k = 0; k < kDiscs; ++k) {
    for (std::size_t other = 0; other < kDiscs; ++other) {
      if (other != k) neighbours.push_back(static_cast<Index>(other));
    }
    offsets.push_back(static_cast<Index>(neighbours.size()));
  }
  OwnedOutlines cells;
  cut_cells({centres, radii, reaches, neighbours, offsets}, water, cells.out());
  OwnedOutlines shapes;
  std::vector<double> targets;
  for (std::size_t k = 0; k < kDiscs; ++k) {
    auto shape = convex_shape(random, {0.0, 0.0}, 1.0);
    const double scale = 1.0 / std::sqrt(polygon_area(shape));
    for (Vec2& corner : shape) corner = {scale * corner.x, scale * corner.y};
    std::copy(shape.begin(), shape.end(), shapes.corners.begin() + kFloeCorners * k);
    shapes.counts[k] = static_cast<Index>(shape.size());
    targets.push_back(1.5 * radii[k] * radii[k]);
  }
  OwnedOutlines floes;
  fit_floes(shapes.view(), centres, cells.view(), targets, 2.0, floes.out());
  for (Index k = 0; k < static_cast<Index>(kDiscs); ++k) {
    const Polygon cell = cells.view()[k];
    const Polygon floe = floes.view()[k];
    CHECK(cell.size() >= 3 && floe.size() >= 3 && floe.size() < kFloeCorners);
    CHECK(nearest_point(centres[static_cast<std::size_t>(k)], cell).distance == 0.0);
    CHECK(polygon_area(floe) > 0.0);
    CHECK(polygon_area(floe) <= targets[static_cast<std::size_t>(k)] * (1.0 + 1e-4));
    for (const Vec2 corner : floe) CHECK(nearest_point(corner, cell).distance <= 1e-9);
    CHECK(convex_distance(cell, blocks.polygons()[0]) >= kGap - 1e-9);
    for (Index other = 0; other < k; ++other) {
      CHECK(convex_distance(cell, cells.view()[other]) >= kGap - 1e-9);
    }
  }
}

/// The nearest point of a square: on its side, at its corner, or the point itself.
void nearest_points_lie_in_polygons() {
  const auto square = rectangle(0.0, 0.0, 1.0, 1.0);
  CHECK(nearest_point({0.5, 0.25}, square).distance == 0.0);
  CHECK(near_to(nearest_point({4.0, 5.0}, square).distance, 5.0));
  CHECK(near_to(nearest_point({0.5, -2.0}, square).point.x, 0.5));
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::floes_keep_apart();
  pushplan::nearest_points_lie_in_polygons();
  return pushplan::tests::finish();
}
