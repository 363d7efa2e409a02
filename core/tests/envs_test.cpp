// Drag, shapes in water, and what a step can reach.
#include <array>
#include <cmath>
#include <numbers>

#include "check.hpp"
#include "pushplan/envs/momentum.hpp"
#include "pushplan/envs/reach.hpp"
#include "pushplan/envs/water.hpp"
#include "pushplan/geometry/convex.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

/// Two half steps are a whole one; without drag nothing changes; drag never turns a body round.
void drag_is_solved_exactly() {
  Xorshift64Star random(1);
  const std::array<double, 1> keeps{1.0};
  for (int trial = 0; trial < 200; ++trial) {
    const Twist start{between(random, -2.0, 2.0), between(random, -2.0, 2.0),
                      between(random, -2.0, 2.0)};
    const std::array<BodyDrag, 1> drag{
        {{{random.uniform(), random.uniform()}, {random.uniform(), random.uniform()}}}};
    const Momentum momentum{keeps, {}, drag};
    const Twist whole = momentum.after(0, start, 0.5);
    const Twist twice = momentum.after(0, momentum.after(0, start, 0.25), 0.25);
    CHECK(near_to(whole.vx, twice.vx) && near_to(whole.omega, twice.omega));
    CHECK(std::abs(whole.vx) <= std::abs(start.vx) && whole.vx * start.vx >= 0.0);
    const std::array<BodyDrag, 1> none{};
    CHECK((Momentum{keeps, {}, none}.after(0, start, 0.5) == start));
    CHECK((Momentum{std::array<double, 1>{0.0}, {}, drag}.after(0, start, 0.5) == Twist{}));
    // the rate of decay is that of the solution
    const double h = 1e-6;
    const Twist soon = momentum.after(0, {start.vx, start.vy, 0.0}, h);
    const double speed = std::hypot(start.vx, start.vy);
    const double lost = 1.0 - std::hypot(soon.vx, soon.vy) / speed;
    CHECK(lost / h < momentum.decay(0, {start.vx, start.vy, 0.0}) + 1e-4);
  }
  const std::array<BodyDrag, 1> quadratic{{{{0.0, 2.0}, {0.0, 0.0}}}};
  const Momentum momentum{keeps, {}, quadratic};
  CHECK(near_to(momentum.after(0, {1.0, 0.0, 0.0}, 0.5).vx, 0.5));  // v / (1 + c v h)
  CHECK(near_to(momentum.decay(0, {1.0, 0.0, 0.0}), 2.0));
}

/// Measures of a square of side 2, and of a polygon that is nearly a disc.
void flow_shapes_have_known_measures() {
  Shapes bodies({rectangle(-1.0, -1.0, 1.0, 1.0)});
  std::vector<Vec2> disc;
  for (int i = 0; i < 720; ++i) {
    const double angle = std::numbers::pi * i / 360.0;
    disc.push_back({std::cos(angle), std::sin(angle)});
  }
  bodies.add(disc);
  std::array<FlowShape, 2> shapes{};
  flow_shapes(bodies.polygons(), shapes);
  CHECK(near_to(shapes[0].width, 8.0 / std::numbers::pi) && near_to(shapes[0].area, 4.0));
  CHECK(near_to(shapes[0].edge_rotation, 1.0));  // four edges, each 2 * 1/8
  CHECK(near_to(shapes[1].width, 2.0, 1e-4) && near_to(shapes[1].edge_rotation, 0.0, 1e-4));
  CHECK(near_to(shapes[1].area_rotation, 0.4 * std::numbers::pi, 1e-3));  // 2 pi / 5
}

/// A drive touches nothing for its clear time, and a straight one up to a wall takes nearly all.
void clear_times_are_clear() {
  Xorshift64Star random(2);
  const Shapes robot({rectangle(-0.3, -0.2, 0.3, 0.2)});
  int limited = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Shapes objects;
    std::vector<Pose> poses;
    for (int k = 0; k < 6; ++k) {
      objects.add(convex_shape(random, {0.0, 0.0}, 0.3));
      poses.push_back({between(random, 1.0, 4.0), between(random, -2.0, 2.0), 0.0});
    }
    Reach reach({robot.polygons(), objects.polygons(), objects.radii});
    const ArcMotion motion{0.0, between(random, 0.2, 1.0), between(random, -0.5, 0.5), false};
    const double time = reach.clear_time({0.0, 0.0, 0.0}, motion, 4.0, 0.01, poses, {});
    limited += time < 4.0;
    for (int i = 0; i <= 40; ++i) {
      const Pose at = arc_pose({0.0, 0.0, 0.0}, motion, time * 0.025 * i);
      for (std::size_t k = 0; k < 6; ++k) {
        const auto outline = placed(poses[k], objects.polygons()[static_cast<Index>(k)]);
        CHECK(!convex_overlap(placed(at, robot.polygons()[0]), outline));
      }
    }
  }
  CHECK(limited > 20 && limited < 100);
  const Shapes wall({rectangle(2.0, -1.0, 2.5, 1.0)});
  const std::array<double, 1> radii{0.0};
  const Obstacles obstacles{wall.polygons(), radii, wall.boxes};
  const Shapes none;
  Reach reach({robot.polygons(), none.polygons(), {}});
  const double time = reach.clear_time({0, 0, 0}, {0.0, 1.0, 0.0, false}, 9.0, 0.01, {}, obstacles);
  CHECK(time > 1.65 && time < 1.7);
}

/// Objects near the robot, in motion, or near either are in reach; others are not.
void reach_spreads_by_one_object() {
  const Shapes robot({rectangle(-0.3, -0.3, 0.3, 0.3)});
  Shapes objects;
  for (int k = 0; k < 4; ++k) objects.add(rectangle(-0.1, -0.1, 0.1, 0.1));
  const std::array<Pose, 4> poses{
      {{0.42, 0.0, 0.0}, {0.65, 0.0, 0.0}, {3.0, 0.0, 0.0}, {6.0, 0.0, 0.0}}};
  const std::array<double, 4> speeds{0.0, 0.0, 0.1, 0.0};
  std::array<bool, 4> found{};
  Reach reach({robot.polygons(), objects.polygons(), objects.radii});
  reach.within({0.0, 0.0, 0.0}, 0.05, poses, speeds, found);
  CHECK((found == std::array<bool, 4>{true, true, true, false}));
  const std::array<bool, 4> loaded{true, false, false, false};
  const std::array<Pose, 4> after{{{0.6, 0.0, 0.0}, poses[1], poses[2], poses[3]}};
  reach.struck(loaded, {after.data(), {1, 4}}, poses, found);
  CHECK((found == std::array<bool, 4>{false, true, false, false}));
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::drag_is_solved_exactly();
  pushplan::flow_shapes_have_known_measures();
  pushplan::clear_times_are_clear();
  pushplan::reach_spreads_by_one_object();
  return pushplan::tests::finish();
}
