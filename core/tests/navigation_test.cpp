// What a planning call promises: plans that fit the world, the same from the same seed, and no
// exception whatever it is given.
#include <array>
#include <cstdlib>
#include <limits>
#include <new>
#include <sstream>
#include <stdexcept>

#include "check.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/planner.hpp"
#include "shapes.hpp"

namespace pushplan::tests {

long allocations_left = -1;  // until memory runs out; never if negative

}  // namespace pushplan::tests

// not inlined: a compiler that sees `free` beside `new` takes it for a mistake
[[gnu::noinline]] void* operator new(std::size_t size) {
  long& left = pushplan::tests::allocations_left;
  if (left > 0) --left;
  void* made = left == 0 ? nullptr : std::malloc(size);
  if (made == nullptr) throw std::bad_alloc();
  return made;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace pushplan {
namespace {

using tests::between;
using tests::rectangle;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Box kRoom{0.0, 0.0, 8.0, 4.0};
constexpr std::array kDrives{Drive::kDifferential, Drive::kConstantSpeed, Drive::kCar,
                             Drive::kOmnidirectional};
constexpr std::array kSearches{SearchKind::kKinodynamic, SearchKind::kPushAware};

bool same(const Plan& a, const Plan& b) {
  return a.status == b.status && a.poses == b.poses && a.times == b.times && a.speeds == b.speeds &&
         a.objects == b.objects && a.interaction_cost == b.interaction_cost;
}

/// A room with a door between two walls, and objects anywhere.
World random_room(Xorshift64Star& random) {
  World world;
  world.robot.parts = {rectangle(-0.3, -0.2, 0.3, 0.2)};
  world.robot.mass = between(random, 5.0, 30.0);
  world.robot.drive = kDrives[static_cast<std::size_t>(random.below(4))];
  world.robot.max_speed = 0.6;
  world.robot.max_turn_rate = 1.5;
  world.robot.turning_radius = world.robot.drive == Drive::kCar ? 0.5 : 0.0;
  if (world.robot.can_stop()) world.robot.max_turn_acceleration = 3.0;
  world.robot_pose = {1.0, 2.0, between(random, -1.0, 1.0)};
  const double door = between(random, 0.5, 2.0);
  const Outline below = rectangle(3.9, 0.0, 4.1, door);
  world.map = make_map({below, rectangle(3.9, door + 1.5, 4.1, 4.0)}, kRoom);
  for (int k = 0; k < 4; ++k) {
    const Vec2 centre{between(random, 2.5, 6.5), between(random, 0.5, 3.5)};
    const Outline outline = tests::convex_shape(random, centre, 0.25);
    world.objects.push_back(make_object({outline}, between(random, 1.0, 5.0)));
  }
  world.goal = {GoalRegion::Kind::kDisc, {7.0, between(random, 1.0, 3.0)}, {}, 0.4};
  return world;
}

World differential_room(std::uint64_t seed) {
  Xorshift64Star random(seed);
  World world = random_room(random);
  world.robot.drive = Drive::kDifferential;
  world.robot.turning_radius = 0.0;
  world.robot.max_turn_acceleration = 3.0;
  return world;
}

bool is_free(const World& world, const Plan& plan) {
  const std::array<Index, 2> one{0, 4};
  CollisionChecker checker({{world.robot.parts[0], one}, 0.37}, world.map->walls());
  return checker.first_blocked(plan.poses) == static_cast<Index>(plan.poses.size());
}

void plans_fit_the_world() {
  Xorshift64Star random(5);
  int solved = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const World world = random_room(random);
    for (const SearchKind search : kSearches) {
      const PlannerOptions options{.search = search, .seed = 3};
      const Plan found = plan(world, options, 2'000);
      if (found.status != PlanStatus::kSolved) continue;
      ++solved;
      const std::size_t count = found.poses.size();
      CHECK(found.poses[0] == world.robot_pose && is_free(world, found));
      CHECK(world.goal.contains({found.poses.back().x, found.poses.back().y}));
      CHECK(found.times.size() == count && found.speeds.size() == count);
      CHECK(found.objects.size() == count * world.objects.size());
      for (std::size_t i = 0; i < count; ++i) {
        CHECK(i == 0 || found.times[i] > found.times[i - 1]);
        CHECK(found.speeds[i] >= 0.0 && found.speeds[i] <= 0.6);
        CHECK(std::abs(found.turn_rates[i]) <= 0.98 * 1.5 + 1e-9);
      }
      CHECK(tests::near_to(found.travel_cost, world.robot.mass * found.lengths.back()));
      CHECK(same(plan(world, options, 2'000), found));
    }
  }
  CHECK(solved >= 22);
  World ship = differential_room(5);
  ship.robot.drive = Drive::kConstantSpeed;
  CHECK(plan(ship, {}, 500).status == PlanStatus::kPathOnly);  // it cannot slow down to turn
}

/// Poses as goals: a differential drive turns on the spot at the end, a car and one of constant
/// speed curve into the pose.
void plans_end_at_headings() {
  Xorshift64Star random(15);
  int solved = 0;
  for (int trial = 0; trial < 12; ++trial) {
    World world = random_room(random);
    world.goal.radius = 0.02;
    world.goal.point.x = 6.0;
    world.goal.heading = between(random, -3.0, 3.0);
    const bool turns = world.robot.turns_on_spot();
    for (const SearchKind search : kSearches) {
      const Plan found = plan(world, {.search = search, .seed = 3}, 2'000);
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
      const bool at_end = world.robot.drive == Drive::kDifferential;
      CHECK(at_end == !std::isnan(found.track().last_heading));
    }
  }
  CHECK(solved >= 20);
  World there = differential_room(15);
  there.goal.heading = there.robot_pose.theta + 3.0;
  there.goal.point = {there.robot_pose.x, there.robot_pose.y};
  const Plan turned = plan(there, {}, 2'000);  // it only turns
  CHECK(turned.lengths.back() == 0.0 && there.goal.reached_by(turned.poses.back()));
  there.goal.heading = there.robot_pose.theta + 0.04;
  CHECK(plan(there).poses.size() == 1);
  there.goal = {GoalRegion::Kind::kDisc, {4.0, 0.2}, {}, 0.1, 1.0};
  CHECK(plan(there, {}, 2'000).status == PlanStatus::kGoalUnreachable);
}

void wrong_worlds_are_refused() {
  const World good = differential_room(7);
  const Outline square = rectangle(1.0, 1.0, 2.0, 2.0);
  std::vector<World> wrong(20, good);
  wrong[0].robot_pose.theta = kNaN;
  wrong[1].robot.parts.clear();
  wrong[2].robot.parts[0][1].x = kNaN;
  wrong[3].map = make_map({square, {}}, kRoom);
  wrong[4].map = make_map({{{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}}}, kRoom);
  wrong[5].objects[0].mass = 0.0;
  wrong[6].objects[0].parts[0] = {{0.0, 0.0}, {1.0, 1.0}, {1.0, 0.0}, {0.0, 1.0}};
  wrong[7].goal.radius = -1.0;
  wrong[8].goal = {GoalRegion::Kind::kLine, {1.0, 1.0}, {0.5, 0.5}, 0.0};
  wrong[9].map = make_map({square}, {0.0, 0.0, kNaN, 4.0});
  wrong[10].robot.max_speed = std::numeric_limits<double>::infinity();
  wrong[11].goal.heading = std::numeric_limits<double>::infinity();
  wrong[12].goal.heading = 1.0;
  wrong[12].goal.heading_tolerance = 0.0;
  wrong[13].goal = {GoalRegion::Kind::kLine, {1.0, 1.0}, {1.0, 0.0}, 0.0, 1.0};
  wrong[14].map = nullptr;
  wrong[15].map = make_map({}, kRoom, {{{{1.0, 1.0}, {2.0, 2.0}}, -0.1}});
  wrong[16].robot.wheels = 1;
  wrong[17].prices = {{1.0, 2.0, 3.0}, 2};
  wrong[18].margin = -1.0;
  wrong[19].map = make_map({{{1.0, 1.0}, {2.0, 1.0}, {kNaN, 2.0}}}, kRoom);
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
  const World world = differential_room(9);
  int asked = 0;
  const Plan found = plan(world, {}, 20'000, [&] { return ++asked == 1; });
  CHECK(found.status == PlanStatus::kNoPlan && asked == 1);
  const Plan thrown = plan(world, {}, 20'000, []() -> bool { throw std::runtime_error("late"); });
  CHECK(thrown.status == PlanStatus::kFailed && thrown.message == "late");
  CHECK(plan(world, {}, -1).status == PlanStatus::kNoPlan);
}

/// A call in pieces has the plan of one run, whatever the pieces are, and never a dearer one.
void pieces_give_the_same_plan() {
  constexpr Index kWhole = 1'500;
  for (const SearchKind search : kSearches) {
    const World world = differential_room(9);
    const PlannerOptions options{.search = search, .seed = 4};
    for (const Index piece : {Index{0}, Index{100}}) {
      PathPlanner planner(differential_room(9), options);
      double cost = std::numeric_limits<double>::infinity();
      while (!planner.done() && planner.counts().iterations < kWhole) {
        planner.run(std::min(piece, kWhole - planner.counts().iterations));
        CHECK(planner.cost() <= cost);
        cost = planner.cost();
      }
      CHECK(same(planner.best(), plan(world, options, kWhole)));
    }
  }
}

void files_lose_nothing() {
  Xorshift64Star random(21);
  for (int trial = 0; trial < 8; ++trial) {
    World world = random_room(random);
    world.map = make_map({rectangle(3.9, 0.0, 4.1, 1.5)}, kRoom, {{{{4.0, 3.0}, {4.0, 4.0}}, 0.1}});
    world.margin = 0.1;
    world.prices = {{0.0, 1.0, 2.0, 0.1}, 2, {0.0, 0.0, 0.0}, 4.0};
    std::stringstream file;
    write_world(world, file);
    const World read = read_world(file);
    CHECK(same(plan(read, {}, 300), plan(world, {}, 300)));
    std::ostringstream again;
    write_world(read, again);
    CHECK(again.str() == file.str());
  }
  std::istringstream wrong("margin 0.1\npolygon 1 2 3\n");
  std::string message;
  try {
    read_world(wrong);
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  CHECK(message.starts_with("line 2: "));
}

/// The first plan across an empty hall is a matter of a few iterations.
void halls_are_crossed_at_once() {
  World world = differential_room(2);
  world.map = make_map({}, {0.0, 0.0, 40.0, 40.0});
  world.goal.point = {38.0, 38.0};
  for (const SearchKind search : kSearches) {
    PathPlanner planner(world, {.search = search});
    planner.run(50);
    CHECK(planner.status() == PlanStatus::kSolved);
  }
}

/// A call ends well wherever memory runs out, and leaves its map as good as ever.
void memory_may_run_out() {
  const World world = differential_room(9);
  const Plan wanted = plan(world, {}, 400);
  int failed = 0;
  for (long left = 1; left < 20'000; left = 1 + left * 3 / 2) {
    const World again = differential_room(9);
    tests::allocations_left = left;
    const Plan found = plan(again, {}, 400);
    tests::allocations_left = -1;
    failed += found.status == PlanStatus::kFailed;
    CHECK(found.status == PlanStatus::kFailed || same(found, wanted));
    CHECK(same(plan(again, {}, 400), wanted));  // what is kept with the map is whole
  }
  CHECK(failed > 10);
}

/// Pure pursuit drives a plan to its end within the limits, and stops without a pose or a plan.
void pure_pursuit_arrives() {
  World world = differential_room(11);
  world.robot.max_acceleration = 1.0;
  const Plan found = plan(world, {}, 2'000);
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
  pushplan::plans_fit_the_world();
  pushplan::plans_end_at_headings();
  pushplan::wrong_worlds_are_refused();
  pushplan::stop_rules_end_calls();
  pushplan::pieces_give_the_same_plan();
  pushplan::files_lose_nothing();
  pushplan::halls_are_crossed_at_once();
  pushplan::memory_may_run_out();
  pushplan::pure_pursuit_arrives();
  return pushplan::tests::finish();
}
