// What pushing does to bodies: who moves, how far, and what is never entered.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "check.hpp"
#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/polygon.hpp"
#include "pushplan/interaction/model.hpp"
#include "pushplan/interaction/occupancy.hpp"
#include "pushplan/interaction/path_sweep.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

/// Objects about their centroids, with what the models want to know of them.
struct Objects {
  void add(std::vector<Vec2> outline) {
    const Vec2 middle = polygon_centroid(outline);
    for (Vec2& corner : outline) corner = {corner.x - middle.x, corner.y - middle.y};
    shapes.add(outline);
    masses.push_back(polygon_area(outline));
    inverse_masses.push_back(1.0 / masses.back());
    inverse_gyration.push_back(1.0 / polygon_inertia(outline));
  }

  /// As many bodies as outlines.
  Compounds compounds() const {
    first.resize(masses.size() + 1);
    std::iota(first.begin(), first.end(), Index{0});
    return {shapes.polygons(), first};
  }

  Shapes shapes;
  mutable std::vector<Index> first;
  std::vector<double> masses;
  std::vector<double> inverse_masses;
  std::vector<double> inverse_gyration;
};

/// A robot among objects and walls.
struct Scene {
  Bodies bodies() const {
    return {robot.polygons(),
            1,
            radius_of(robot.vertices),
            objects.shapes.polygons(),
            objects.compounds(),
            objects.shapes.radii,
            objects.inverse_masses,
            objects.inverse_gyration,
            walls.polygons(),
            walls.boxes};
  }

  Shapes robot{{rectangle(-0.3, -0.3, 0.3, 0.3)}};
  Objects objects;
  Shapes walls;
};

constexpr QuasiStaticSettings kSettings{0.02, 1e-4, 0.01, 40, 0.4, 0.3};

/// A box before the middle of a flat bumper goes with it; what is not touched stays as it is.
void boxes_go_with_the_bumper() {
  Scene scene;
  scene.objects.add(rectangle(0.0, 0.0, 0.4, 0.4));
  scene.objects.add(rectangle(0.0, 0.0, 0.4, 0.4));
  QuasiStatic model(scene.bodies(), kSettings);
  std::vector<Pose> poses{{0.6, 0.0, 0.0}, {0.0, 0.9, 0.4}};
  std::vector<double> lengths(2, 0.0);
  CHECK(model.advance({0.0, 0.0, 0.0}, {0.5, 0.0, 0.0}, poses, lengths));
  CHECK(near_to(poses[0].x, 1.0, 1e-3) && near_to(poses[0].y, 0.0) && near_to(poses[0].theta, 0.0));
  CHECK(near_to(lengths[0], 0.4, 1e-3) && lengths[1] == 0.0);
  CHECK((poses[1] == Pose{0.0, 0.9, 0.4}));
}

/// An object against a wall jams the robot and does not enter the wall.
void walls_jam_the_robot() {
  Scene scene;
  scene.objects.add(rectangle(0.0, 0.0, 0.4, 0.4));
  scene.walls.add(rectangle(1.0, -2.0, 1.5, 2.0));
  QuasiStatic model(scene.bodies(), kSettings);
  std::vector<Pose> poses{{0.6, 0.0, 0.0}};
  std::vector<double> lengths(1, 0.0);
  Pose robot{0.0, 0.0, 0.0};
  bool free = true;
  for (int step = 0; step < 20 && free; ++step) {
    const Pose next{robot.x + 0.05, 0.0, 0.0};
    free = model.advance(robot, next, poses, lengths);
    if (free) robot = next;
  }
  CHECK(!free && robot.x > 0.2 && robot.x < 0.35);
  CHECK(poses[0].x + 0.2 <= 1.0 + kSettings.jam_depth + 1e-9);
  CHECK(model.robot_held({1.0, 0.0, 0.0}) && !model.robot_held({0.5, 0.0, 0.0}));
}

/// Random pushes: no overlap with the robot is left, no body goes farther than it is pushed by.
void pushes_leave_no_overlap() {
  Xorshift64Star random(1);
  int moved = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Scene scene;
    std::vector<Pose> poses;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        scene.objects.add(convex_shape(random, {0.0, 0.0}, 0.22));
        poses.push_back({0.8 + 0.5 * i, 0.5 * (j - 1), between(random, -3.0, 3.0)});
      }
    }
    const std::vector<Pose> before = poses;
    std::vector<double> lengths(9, 0.0);
    QuasiStatic model(scene.bodies(), kSettings);
    const Pose from{0.0, between(random, -0.3, 0.3), 0.0};
    const Pose to{0.9, from.y, between(random, -0.3, 0.3)};
    if (!model.advance(from, to, poses, lengths)) continue;
    const auto robot = placed(to, scene.robot.polygons()[0]);
    for (std::size_t k = 0; k < 9; ++k) {
      const auto outline = scene.objects.shapes.polygons()[static_cast<Index>(k)];
      CHECK(convex_penetration(robot, placed(poses[k], outline)).depth <= kSettings.jam_depth);
      const double way = std::hypot(poses[k].x - before[k].x, poses[k].y - before[k].y);
      CHECK(way <= lengths[k] + 1e-12 && lengths[k] <= 0.9 + 0.3 * 0.5 + 0.1);
      if (lengths[k] == 0.0) CHECK(poses[k].x == before[k].x && poses[k].y == before[k].y);
      moved += lengths[k] > 0.0;
    }
    std::vector<Pose> again = before;
    std::vector<double> same(9, 0.0);
    QuasiStatic(scene.bodies(), kSettings).advance(from, to, again, same);
    CHECK(again == poses && same == lengths);
  }
  CHECK(moved > 100);
}

/// Floes: the work is the sum of masses times ways; far ones stay; a near sweep is the whole one.
void floes_share_the_work() {
  Xorshift64Star random(2);
  Objects floes;
  std::vector<Pose> start;
  for (int i = 0; i < 40; ++i) {
    floes.add(convex_shape(random, {0.0, 0.0}, 0.3));
    start.push_back({0.6 * (i % 5), 0.8 * (i / 5) - 2.4, between(random, -3.0, 3.0)});
  }
  const Shapes hull({rectangle(-0.5, -0.2, 0.5, 0.2)});
  const IceBodies bodies{
      hull.polygons(), radius_of(hull.vertices), floes.compounds(), floes.shapes.radii,
      floes.masses,    floes.inverse_gyration};
  const IceSettings settings{0.02, 8, 0.1, 0.1, 1e-6};
  std::vector<Pose> path;
  for (int i = 0; i <= 10; ++i) path.push_back({-1.0 + 0.1 * i, 0.0, 0.0});
  std::vector<Pose> poses = start;
  std::vector<Pose> swept(11 * 40);
  const double work = IceContacts(bodies, settings).sweep(path, poses, {swept.data(), {11, 40}});
  std::vector<double> works(10);
  step_works({swept.data(), {11, 40}}, floes.masses, works);
  double sum = 0.0;
  for (const double part : works) sum += part;
  CHECK(work > 0.0 && sum > 0.0 && sum <= work * (1.0 + 1e-9));
  for (std::size_t k = 0; k < 40; ++k) {
    if (std::abs(start[k].y) > 2.0) CHECK(poses[k] == start[k]);
  }
  std::vector<Pose> near = start;
  std::vector<Pose> rows(11 * 40);
  std::vector<double> parts(10);
  sweep_near(path, near, bodies, settings, 50.0, {rows.data(), {11, 40}}, parts);
  CHECK(near == poses && rows == swept && parts == works);
}

/// A raster covers as much as the area of what lies on it.
void rasters_cover_areas() {
  const Shapes box({rectangle(-0.5, -0.25, 0.5, 0.25)});
  const std::vector<Pose> poses{{2.0, 2.0, 0.3}};
  std::vector<float> cells(40 * 40);
  cover_objects(poses, box.polygons(), {{0.0, 0.0, 0.0}, 0.1}, {cells.data(), {40, 40}});
  double area = 0.0;
  for (const float part : cells) {
    CHECK(part >= 0.0F && part <= 1.0F);
    area += 0.01 * static_cast<double>(part);
  }
  CHECK(near_to(area, 0.5, 0.02));
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::boxes_go_with_the_bumper();
  pushplan::walls_jam_the_robot();
  pushplan::pushes_leave_no_overlap();
  pushplan::floes_share_the_work();
  pushplan::rasters_cover_areas();
  return pushplan::tests::finish();
}
