// Polygons, distances, sight and distance fields against what defines them.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "check.hpp"
#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/geometry/obstacle_grid.hpp"
#include "pushplan/geometry/polygon.hpp"
#include "pushplan/geometry/raster.hpp"
#include "pushplan/geometry/regions.hpp"
#include "pushplan/geometry/shortest_path.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

/// Distances are symmetric and 0 where polygons overlap only; the penetration says the same.
void distances_and_penetrations_agree() {
  Xorshift64Star random(1);
  int overlaps = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto a = convex_shape(random, {0.0, 0.0}, 1.0);
    auto b = convex_shape(random, {between(random, -2.5, 2.5), between(random, -2.5, 2.5)}, 1.0);
    const double distance = convex_distance(a, b);
    const bool overlap = convex_overlap(a, b);
    const Penetration found = convex_penetration(a, b);
    overlaps += overlap;
    CHECK(distance == convex_distance(b, a));
    CHECK((distance == 0.0) == overlap && convex_overlap(b, a) == overlap);
    CHECK((found.depth > 0.0) == overlap);
    CHECK(distance >= -found.depth - 1e-12);
    CHECK(near_to(std::hypot(found.normal.x, found.normal.y), 1.0));
    if (!overlap) continue;
    const double by = found.depth * (1.0 + 1e-9) + 1e-12;
    for (Vec2& corner : b)
      corner = {corner.x + by * found.normal.x, corner.y + by * found.normal.y};
    CHECK(!convex_overlap(a, b) && convex_distance(a, b) < 1e-6);
  }
  CHECK(overlaps > 200 && overlaps < 1800);
  CHECK(convex_distance(rectangle(0, 0, 1, 1), rectangle(4, 5, 6, 6)) == 5.0);
}

/// The measures of a rectangle, wherever it lies.
void measures_are_those_of_rectangles() {
  Xorshift64Star random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Pose pose = random_pose(random, 100.0);
    const double w = between(random, 0.1, 3.0);
    const double h = between(random, 0.1, 3.0);
    const auto corners = placed(pose, rectangle(0.0, 0.0, w, h));
    const Vec2 middle = placed(pose, std::array<Vec2, 1>{{{0.5 * w, 0.5 * h}}})[0];
    const Vec2 centroid = polygon_centroid(corners);
    CHECK(near_to(polygon_area(corners), w * h));
    CHECK(near_to(centroid.x, middle.x) && near_to(centroid.y, middle.y));
    CHECK(near_to(polygon_inertia(corners), (w * w + h * h) / 12.0));
    CHECK(near_to(least_width(corners), std::min(w, h)));
    CHECK(std::abs(wrap_angle(pose.theta + 20.0)) <= std::numbers::pi);
  }
}

/// A line of sight keeps its margin, is the same from both ends, and the same by the grid.
void sight_keeps_its_margin() {
  Xorshift64Star random(3);
  int seen = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Shapes cores;
    std::vector<double> radii;
    for (int k = 0; k < 8; ++k) {
      const Vec2 centre{between(random, -5.0, 5.0), between(random, -5.0, 5.0)};
      cores.add(convex_shape(random, centre, 0.7));
      radii.push_back(between(random, 0.0, 0.2));
      Box& box = cores.boxes.back();
      const double r = radii.back();
      box = {box.x_min - r, box.y_min - r, box.x_max + r, box.y_max + r};
    }
    const Obstacles obstacles{cores.polygons(), radii, cores.boxes};
    const ObstacleGrid grid(obstacles, 0.2);
    GridSight sight(grid);
    for (int line = 0; line < 40; ++line) {
      const Vec2 p{between(random, -6.0, 6.0), between(random, -6.0, 6.0)};
      const Vec2 q{between(random, -6.0, 6.0), between(random, -6.0, 6.0)};
      const bool sees = line_of_sight(p, q, obstacles, 0.2);
      CHECK(sight.sees(p, q, 0.2) == sees && line_of_sight(q, p, obstacles, 0.2) == sees);
      seen += sees;
      for (int i = 0; sees && i <= 20; ++i) {
        const double t = 0.05 * i;
        const Vec2 at{p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)};
        CHECK(obstacle_distance(at, obstacles) >= 0.2 - 1e-9);
      }
    }
    std::vector<double> values(30 * 20);
    const Cells cells{{-6.0, -4.0}, 0.4};
    fill_clearance({values.data(), {20, 30}}, 0, 600, cells, obstacles);
    for (Index cell = 0; cell < 600; cell += 7) {
      const double exact = obstacle_distance(cells.centre(cell / 30, cell % 30), obstacles);
      CHECK(near_to(values[static_cast<std::size_t>(cell)], std::max(exact, 0.0)) ||
            near_to(values[static_cast<std::size_t>(cell)], exact));
    }
  }
  CHECK(seen > 100 && seen < 1500);
}

/// A pixel is set where its centre lies in the polygon.
void pixels_are_set_by_their_centres() {
  Xorshift64Star random(4);
  ConvexFiller filler;
  for (int trial = 0; trial < 200; ++trial) {
    const Vec2 centre{between(random, -4.0, 24.0), between(random, -4.0, 19.0)};
    const auto polygon = convex_shape(random, centre, between(random, 0.3, 9.0));
    std::vector<std::uint8_t> pixels(15 * 20, 0);
    filler.fill<std::uint8_t>({pixels.data(), {15, 20}}, polygon, 1);
    for (Index i = 0; i < 300; ++i) {
      const Vec2 p{static_cast<double>(i % 20) + 0.5, static_cast<double>(i / 20) + 0.5};
      const double depth = core_distance(p, polygon);
      if (std::abs(depth) < 1e-9) continue;
      CHECK((pixels[static_cast<std::size_t>(i)] == 1) == (depth < 0.0));
    }
  }
}

/// The nearest points of a disc, a half plane and a polygon.
void nearest_points_are_in_their_regions() {
  const Shapes square({rectangle(1.0, 1.0, 2.0, 2.0)});
  const std::array<Disc, 1> discs{{{{0.0, 0.0}, 1.0}}};
  const std::array<HalfPlane, 1> planes{{{{0.0, 5.0}, {0.0, 1.0}}}};
  const Regions regions{discs, planes, square.polygons()};
  const Vec2 p{3.0, 4.0};
  CHECK(regions.count() == 3);
  CHECK(near_to(nearest_in_region(0, p, regions).x, 0.6));
  CHECK(near_to(nearest_in_region(1, p, regions).y, 5.0));
  CHECK(near_to(nearest_in_region(2, p, regions).x, 2.0));
  CHECK(near_to(region_distance(p, regions), 1.0));
  CHECK(region_distance({1.5, 1.5}, regions) == 0.0);
  const std::array<Segment, 1> first{{{{0.0, 0.0}, {2.0, 2.0}}}};
  const std::array<Segment, 1> second{{{{0.0, 2.0}, {2.0, 0.0}}}};
  const std::vector<Vec2> crossing = segment_crossings(first, second);
  CHECK(crossing.size() == 1 && near_to(crossing[0].x, 1.0) && near_to(crossing[0].y, 1.0));
}

/// Grown outlines hold a disc about each corner and reach little beyond; discs inside grow along.
void grown_outlines_hold_all_within_the_margin() {
  Xorshift64Star random(5);
  for (int trial = 0; trial < 300; ++trial) {
    const auto corners = convex_shape(random, {0.1, 0.0}, 1.0);
    const double margin = between(random, 0.01, 2.0);
    const auto grown = grown_outline(corners, margin);
    for (const Vec2 corner : corners) CHECK(core_distance(corner, grown) <= 1e-9 - margin);
    for (const Vec2 corner : grown) {
      const double away = core_distance(corner, corners);
      CHECK(away >= margin - 1e-9 && away <= 1.56 * margin);
    }
    const double inside = inscribed_radius(corners);
    CHECK(near_to(inside, std::max(0.0, -core_distance({0.0, 0.0}, corners))));
    if (inside > 0.0) CHECK(near_to(inscribed_radius(grown), inside + margin));
    CHECK(grown_outline(corners, 0.0).size() == corners.size());
  }
}

/// A search and the distances from all bends agree, with a line to pass and a start at a wall.
void shortest_paths_go_around_walls() {
  OwnPolygons blocks;
  blocks.add(rectangle(4.0, 0.0, 5.0, 6.0));
  const StaticMap map(blocks, {{{{7.0, 4.0}, {7.0, 10.0}}, 0.1}}, {0.0, 0.0, 10.0, 10.0});
  const GoalRegion disc{GoalRegion::Kind::kDisc, {9.0, 5.0}, {}, 0.5};
  const GoalRegion line{GoalRegion::Kind::kLine, {8.0, 0.0}, {1.0, 0.0}};
  for (const GoalRegion& goal : {disc, line}) {
    for (const Vec2 start : {Vec2{1.0, 2.0}, Vec2{3.9, 1.0}, Vec2{4.5, 3.0}}) {
      ShortestPath search(map, 0.2, start, regions_of(goal));
      while (!search.run()) {
      }
      const Route route = GoalDistances(map, 0.2, regions_of(goal)).path_from(start);
      CHECK(search.map().keeps_clearance(start) == (start.x < 3.9));
      CHECK(search.points().size() == route.points.size());
      if (start.x == 4.5) {
        CHECK(std::isinf(search.length()) && std::isinf(route.length));
        continue;
      }
      CHECK(near_to(search.length(), route.length, 1e-6));
      double length = 0.0;
      for (std::size_t i = 1; i < route.points.size(); ++i) {
        const Vec2 a = search.points()[i - 1];
        const Vec2 b = search.points()[i];
        length += std::hypot(b.x - a.x, b.y - a.y);
      }
      CHECK(near_to(length, search.length()) && length > 8.0);
      CHECK(goal.distance(search.points().back()) < 1e-6);
    }
  }
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::distances_and_penetrations_agree();
  pushplan::measures_are_those_of_rectangles();
  pushplan::sight_keeps_its_margin();
  pushplan::pixels_are_set_by_their_centres();
  pushplan::nearest_points_are_in_their_regions();
  pushplan::grown_outlines_hold_all_within_the_margin();
  pushplan::shortest_paths_go_around_walls();
  return pushplan::tests::finish();
}
