// Plans in a world that `pushplan plan --plain FILE` has written, and prints the plan:
//   plan_file FILE push-aware|kinodynamic-rrt SEED ITERATIONS
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <string>

#include "pushplan/planner.hpp"

namespace {

/// The parameters with which Python's planners of these names begin.
pushplan::PlannerOptions options_of(const std::string& planner, std::uint64_t seed) {
  pushplan::PlannerOptions options;
  options.seed = seed;
  if (planner == "push-aware") return options;
  options.search = pushplan::SearchKind::kKinodynamic;
  options.push_weight = 3.0;
  options.margin = 0.06;
  options.turn_fraction = 0.9;
  options.contact.friction = 0.0;
  options.contact.static_friction = 0.0;
  return options;
}

int print_plan(char** arguments) {
  std::ifstream file(arguments[1]);
  if (!file) {
    std::fprintf(stderr, "cannot read %s\n", arguments[1]);
    return 2;
  }
  const pushplan::World world = pushplan::read_world(file);
  const auto options = options_of(arguments[2], std::strtoull(arguments[3], nullptr, 10));
  const pushplan::Plan plan = pushplan::plan(world, options, std::atol(arguments[4]));
  for (std::size_t i = 0; i < plan.poses.size(); ++i) {
    const pushplan::Pose& pose = plan.poses[i];
    std::printf("%.17g %.17g %.17g %.17g %.17g %.17g\n", plan.times[i], pose.x, pose.y, pose.theta,
                plan.speeds[i], plan.turn_rates[i]);
  }
  if (plan.poses.empty()) std::fprintf(stderr, "no plan: %s\n", plan.message.c_str());
  return plan.poses.empty() ? 1 : 0;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) {
    std::fprintf(stderr, "plan_file FILE push-aware|kinodynamic-rrt SEED ITERATIONS\n");
    return 2;
  }
  try {
    return print_plan(arguments);
  } catch (const std::exception& error) {  // a line of the file is wrong
    std::fprintf(stderr, "%s: %s\n", arguments[1], error.what());
    return 2;
  }
}
