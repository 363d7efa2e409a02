// What a planning call promises: plans that fit the world, the same from the same seed, and no
// exception whatever it is given.
#include "pushplan/planner.hpp"

#include <array>
#include <limits>
#include <stdexcept>

#include "check.hpp"
#include "pushplan/motion/collision.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using tests::between;
using tests::rectangle;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::array kDrives{Drive::kDifferential, Drive::kConstantSpeed, Drive::kCar};
constexpr std::array kSearches{SearchKind::kKinodynamic, SearchKind::kPushAware};

/// A room with a door between two walls, and objects anywhere.
World random_room(Xorshift64Star& random) {
  World world;
  world.robot.parts = {rectangle(-0.3, -0.2, 0.3, 0.2)};
  world.robot.mass = between(random, 5.0, 30.0);
  world.robot.drive = kDrives[static_cast<std::size_t>(random.below(3))];
  world.robot.max_speed = 0.6;
  world.robot.max_turn_rate = 1.5;
  world.robot.turning_radius = world.robot.drive == Drive::kCar ? 0.5 : 0.0;
  world.robot.max_turn_acceleration = 3.0;
  world.robot_pose = {1.0, 2.0, between(random, -1.0, 1.0)};
  const double door = between(random, 0.5, 2.0);
  world.walls = {rectangle(3.9, 0.0, 4.1, door), rectangle(3.9, door + 1.5, 4.1, 4.0)};
  for (int k = 0; k < 4; ++k) {
    world.objects.push_back(
        {tests::convex_shape(random, {between(random, 2.5, 6.5), between(random, 0.5, 3.5)}, 0.25),
         between(random, 1.0, 5.0)});
  }
  world.goal = {GoalRegion::Kind::kDisc, {7.0, between(random, 1.0, 3.0)}, {}, 0.4};
  world.bounds = {0.0, 0.0, 8.0, 4.0};
  return world;
}

bool is_free(const World& world, const Plan& plan) {
  const std::array<Index, 2> one{0, 4};
  const std::array<Index, 3> two{0, 4, 8};
  std::vector<Vec2> walls = world.walls[0];
  walls.insert(walls.end(), world.walls[1].begin(), world.walls[1].end());
  const std::array boxes{box_around(world.walls[0]), box_around(world.walls[1])};
  const std::array groups{world.bounds};
  CollisionChecker checker({{world.robot.parts[0], one}, 0.37},
                           {{walls, two}, boxes, groups, world.bounds});
  return checker.first_blocked(plan.poses) == static_cast<Index>(plan.poses.size());
}

void plans_fit_the_world() {
  Xorshift64Star random(5);
  int solved = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const World world = random_room(random);
    for (const SearchKind search : kSearches) {
      const PlannerOptions options{.search = search, .seed = 3, .iterations = 2'000};
      const Plan found = plan(world, options);
      if (found.status != PlanStatus::kSolved) continue;
      ++solved;
      const std::size_t count = found.poses.size();
      CHECK(found.poses[0] == world.robot_pose && is_free(world, found));
      CHECK(world.goal.contains({found.poses.back().x, found.poses.back().y}));
      CHECK(found.times.size() == count && found.speeds.size() == count);
      CHECK(found.objects.size() == count * world.objects.size());
      for (std::size_t i = 0; i < count; ++i) {
        CHECK(i == 0 || found.times[i] > found.times[i - 1]);
        CHECK(found.speeds[i] > 0.0 && found.speeds[i] <= 0.6);
        CHECK(std::abs(found.turn_rates[i]) <= 0.9 * 1.5 + 1e-9);
      }
      CHECK(tests::near_to(found.travel_cost, world.robot.mass * found.lengths.back()));
      CHECK(plan(world, options).poses == found.poses);
    }
  }
  CHECK(solved >= 22);
}

/// Poses as goals: a differential drive turns on the spot at the end, others curve into the pose.
void plans_end_at_headings() {
  Xorshift64Star random(15);
  int solved = 0;
  for (int trial = 0; trial < 12; ++trial) {
    World world = random_room(random);
    world.goal.radius = 0.02;
    world.goal.point.x = 6.0;
    world.goal.heading = between(random, -3.0, 3.0);
    const bool turns = world.robot.drive == Drive::kDifferential;
    for (const SearchKind search : kSearches) {
      const Plan found = plan(world, {.search = search, .seed = 3, .iterations = 4'000});
      if (found.status != PlanStatus::kSolved) continue;
      ++solved;
      CHECK(world.goal.reached_by(found.poses.back()) && is_free(world, found));
      CHECK(found.poses[0] == world.robot_pose);
      for (std::size_t i = 1; i < found.poses.size(); ++i) {
        CHECK(found.times[i] > found.times[i - 1]);
        const double turn = std::abs(found.poses[i].theta - found.poses[i - 1].theta);
        const double moved = found.lengths[i] - found.lengths[i - 1];
        CHECK(moved > 0.0 || (turns && turn <= 0.15 + 1e-9));
        if (!turns) CHECK(turn * 0.4 <= moved + 1e-9);
      }
      CHECK(turns == !std::isnan(found.track().last_heading));
    }
  }
  CHECK(solved >= 20);
  World there = random_room(random);
  there.robot.drive = Drive::kDifferential;
  there.robot.turning_radius = 0.0;
  there.goal.heading = there.robot_pose.theta + 3.0;
  there.goal.point = {there.robot_pose.x, there.robot_pose.y};
  const Plan turned = plan(there);  // it only turns
  CHECK(turned.lengths.back() == 0.0 && there.goal.reached_by(turned.poses.back()));
  there.goal.heading = there.robot_pose.theta + 0.04;
  CHECK(plan(there).poses.size() == 1);
  there.goal.point = {4.0, 0.2};
  CHECK(plan(there).status == PlanStatus::kNoPlan);
}

void wrong_worlds_are_refused() {
  Xorshift64Star random(7);
  const World good = random_room(random);
  std::vector<World> wrong(14, good);
  wrong[0].robot_pose.theta = kNaN;
  wrong[1].robot.parts.clear();
  wrong[2].robot.parts[0][1].x = kNaN;
  wrong[3].walls[0] = {};
  wrong[4].walls[0] = {{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}};
  wrong[5].objects[0].mass = 0.0;
  wrong[6].objects[0].outline = {{0.0, 0.0}, {1.0, 1.0}, {1.0, 0.0}, {0.0, 1.0}};
  wrong[7].goal.radius = -1.0;
  wrong[8].goal = {GoalRegion::Kind::kLine, {1.0, 1.0}, {0.5, 0.5}, 0.0};
  wrong[9].bounds.x_max = kNaN;
  wrong[10].robot.max_speed = std::numeric_limits<double>::infinity();
  wrong[11].goal.heading = std::numeric_limits<double>::infinity();
  wrong[12].goal.heading = 1.0;
  wrong[12].goal.heading_tolerance = 0.0;
  wrong[13].goal = {GoalRegion::Kind::kLine, {1.0, 1.0}, {1.0, 0.0}, 0.0, 1.0};
  for (const World& world : wrong) {
    const Plan found = plan(world);
    CHECK(found.status == PlanStatus::kInvalidInput && !found.message.empty());
    CHECK(found.poses.empty());
  }
  CHECK(plan({}).status == PlanStatus::kInvalidInput);
  CHECK(plan(good, {.margin = kNaN}).status == PlanStatus::kInvalidInput);
  World inside = good;
  inside.robot_pose = {4.0, 0.2, 0.0};
  CHECK(plan(inside).status == PlanStatus::kStartBlocked);
  World there = good;
  there.robot_pose = {there.goal.point.x, there.goal.point.y, 0.0};
  CHECK(plan(there).status == PlanStatus::kSolved && plan(there).poses.size() == 1);
}

void stop_rules_end_calls() {
  Xorshift64Star random(9);
  const World world = random_room(random);
  int asked = 0;
  const Plan found = plan(world, {.stop = [&] { return ++asked == 3; }});
  CHECK(found.status == PlanStatus::kNoPlan && asked == 3);
  const Plan thrown = plan(world, {.stop = []() -> bool { throw std::runtime_error("late"); }});
  CHECK(thrown.status == PlanStatus::kFailed && thrown.message == "late");
  CHECK(plan(world, {.iterations = -1}).status == PlanStatus::kNoPlan);
}

/// Pure pursuit drives a plan to its end within the limits, and stops without a pose or a plan.
/// On a map that is too large for a table the iterations end the call too.
void large_maps_end() {
  Xorshift64Star random(7);
  World world = random_room(random);
  world.walls = {rectangle(-20.0, -0.1, -19.0, 0.1), rectangle(-20.0, 20.0, -19.0, 21.0)};
  world.bounds = {-30.0, -30.0, 30.0, 30.0};
  const Plan plan = pushplan::plan(world, {.search = SearchKind::kPushAware, .iterations = 4'000});
  CHECK(plan.status == PlanStatus::kSolved || plan.status == PlanStatus::kNoPlan);
}

void pure_pursuit_arrives() {
  Xorshift64Star random(11);
  World world = random_room(random);
  world.robot.drive = Drive::kDifferential;
  world.robot.turning_radius = 0.0;
  world.robot.max_acceleration = 1.0;
  const Plan found = plan(world, {.iterations = 2'000});
  CHECK(found.status == PlanStatus::kSolved);
  PurePursuit pursuit = make_pure_pursuit(world.robot);
  Pose pose = world.robot_pose;
  mpc::Twist last{0.0, 0.0};
  for (int i = 0; i < 5'000 && !world.goal.contains({pose.x, pose.y}); ++i) {
    const mpc::Twist command = pursuit.follow(found.track(), pose, 0.01);
    CHECK(std::abs(command.v - last.v) <= 0.01 + 1e-12 && command.v <= 0.6);
    CHECK(std::abs(command.w - last.w) <= 0.03 + 1e-12);
    last = command;
    pose = mpc::arc(pose, command, 0.01).end;
  }
  CHECK(world.goal.contains({pose.x, pose.y}));
  for (int i = 0; i < 100; ++i) last = pursuit.follow(found.track(), {kNaN, 0.0, 0.0}, 0.01);
  CHECK(last.v == 0.0 && last.w == 0.0);
  last = pursuit.follow(Plan{}.track(), pose, 0.01);
  CHECK(last.v == 0.0 && last.w == 0.0);
  last = make_tracker(world.robot).follow(Plan{}.track(), pose, 0.0, 0.01);
  CHECK(last.v == 0.0 && last.w == 0.0);
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::large_maps_end();
  pushplan::plans_fit_the_world();
  pushplan::plans_end_at_headings();
  pushplan::wrong_worlds_are_refused();
  pushplan::stop_rules_end_calls();
  pushplan::pure_pursuit_arrives();
  return pushplan::tests::finish();
}
