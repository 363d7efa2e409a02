// Plans through a room with two boxes to a pose, and follows the plan at 100 Hz with both
// controllers.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <new>

#include "pushplan/planner.hpp"

namespace {

long allocations = 0;

constexpr double kPeriod = 0.01;  // of the control loop [s]
constexpr int kSteps = 6'000;     // at most

pushplan::Outline rectangle(double x_min, double y_min, double x_max, double y_max) {
  return {{x_min, y_min}, {x_max, y_min}, {x_max, y_max}, {x_min, y_max}};
}

/// A room of 8 m x 4 m whose middle wall leaves a door, in which a box stands.
pushplan::World room() {
  pushplan::World world;
  world.robot.parts = {rectangle(-0.3, -0.2, 0.3, 0.2)};
  world.robot.mass = 20.0;
  world.robot.max_speed = 0.8;
  world.robot.max_turn_rate = 1.5;
  world.robot.max_acceleration = 1.0;
  world.robot.max_turn_acceleration = 4.0;
  world.robot_pose = {1.0, 1.0, 0.0};
  world.map = pushplan::make_map({rectangle(3.9, 0.0, 4.1, 1.2), rectangle(3.9, 2.6, 4.1, 4.0)},
                                 {0.0, 0.0, 8.0, 4.0});
  world.objects = {pushplan::make_object({rectangle(3.8, 1.7, 4.2, 2.1)}, 3.0),
                   pushplan::make_object({rectangle(5.8, 1.8, 6.2, 2.2)}, 3.0)};
  world.goal = {pushplan::GoalRegion::Kind::kDisc, {7.0, 3.0}, {}, 0.1};
  world.goal.heading = 1.57;
  return world;
}

/// Where the robot is after a command has been held for a period. On a robot, this is its drive
/// and its localisation.
pushplan::Pose drive(const pushplan::Pose& pose, const pushplan::mpc::Twist& twist) {
  return pushplan::mpc::arc(pose, twist, kPeriod).end;
}

/// Follows a plan to its end. `command(pose, time)` is asked every period. True if the robot
/// arrives at the goal and its heading, nothing was allocated on the way, and a pose that is none
/// stops it.
template <class Command>
bool follow(const char* name, const pushplan::World& world, const pushplan::Plan& plan,
            Command&& command) {
  pushplan::Pose pose = world.robot_pose;
  const pushplan::Pose& end = plan.poses.back();
  const long before = allocations;
  int step = 0;
  while (step < kSteps && !world.goal.reached_by(pose)) {
    pose = drive(pose, command(pose, kPeriod * step));
    ++step;
  }
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  pushplan::mpc::Twist last{1.0, 1.0};
  for (int i = 0; i < 200; ++i) {  // it brakes as its limits allow
    last = command({kNaN, pose.y, pose.theta}, kPeriod * ++step);
  }
  const bool arrived = world.goal.reached_by(pose);
  const bool stopped = last.v == 0.0 && last.w == 0.0;
  const long allocated = allocations - before;
  std::printf("  %s: %s after %.1f s, %.2f m from the plan's end, %ld allocations, %s\n", name,
              arrived ? "in the goal" : "not in the goal", kPeriod * step,
              std::hypot(pose.x - end.x, pose.y - end.y), allocated,
              stopped ? "stopped without a pose" : "drives on without a pose");
  return arrived && stopped && allocated == 0;
}

bool plan_and_follow(const char* name, pushplan::SearchKind search) {
  const pushplan::World world = room();
  pushplan::PlannerOptions options;
  options.search = search;
  const pushplan::Plan plan = pushplan::plan(world, options, 4'000);
  if (plan.status != pushplan::PlanStatus::kSolved) {
    std::printf("%s: no plan: %s\n", name, plan.message.c_str());
    return false;
  }
  std::printf("%s: %zu poses, %.1f s, robot %.1f kg m, objects %.1f kg m\n", name,
              plan.poses.size(), plan.times.back(), plan.travel_cost, plan.interaction_cost);
  const pushplan::mpc::ReferencePath track = plan.track();
  pushplan::PurePursuit pursuit = pushplan::make_pure_pursuit(world.robot);
  pushplan::mpc::Tracker tracker = pushplan::make_tracker(world.robot);
  pursuit.begin_track();
  tracker.begin_track();
  const bool pursued = follow("pure pursuit", world, plan, [&](const pushplan::Pose& pose, double) {
    return pursuit.follow(track, pose, kPeriod);
  });
  const bool tracked =
      follow("predictive tracker", world, plan, [&](const pushplan::Pose& pose, double time) {
        return tracker.follow(track, pose, time, kPeriod);
      });
  return pursued && tracked;
}

}  // namespace

// Counts allocations, to show that the control loop makes none.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

int main() {
  bool good = plan_and_follow("kinodynamic", pushplan::SearchKind::kKinodynamic);
  good = plan_and_follow("push-aware", pushplan::SearchKind::kPushAware) && good;
  pushplan::World wrong = room();
  wrong.robot_pose.x = std::numeric_limits<double>::quiet_NaN();
  const pushplan::Plan refused = pushplan::plan(wrong);
  std::printf("a pose that is not a number: %s\n", refused.message.c_str());
  return good && refused.status == pushplan::PlanStatus::kInvalidInput ? 0 : 1;
}
