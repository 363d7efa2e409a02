// Planning calls: the cheapest path to the goal, by its length and by what it pushes.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "pushplan/control/mpc/tracker.hpp"
#include "pushplan/control/pure_pursuit.hpp"
#include "pushplan/world.hpp"

namespace pushplan {

enum class SearchKind {
  kKinodynamic,  // random trees: the first plan sooner
  kPushAware     // best-first searches: better plans
};

enum class PlanStatus {
  kSolved,
  kInvalidInput,  // `message` says what is wrong
  kStartBlocked,  // the robot overlaps a wall, or is out of the bounds
  kNoPlan,        // none was found within the budget
  kFailed         // memory ran out, or the stop rule threw
};

struct PlannerOptions {
  SearchKind search = SearchKind::kPushAware;
  std::uint64_t seed = 0;        // the same one gives the same plan, without a stop rule
  Index iterations = 20'000;     // nodes and shortcuts until the call ends
  std::function<bool()> stop{};  // asked every few milliseconds: true ends the call
  double push_weight = 2.5;      // w
  double margin = 0.08;          // clearance from walls where there is room [circumscribed radii]
  double turn_fraction = 0.9;    // of the greatest turn rate; the rest is for tracking
  double friction = 0.1;         // Coulomb coefficient between robot and objects
  double static_friction = 0.5;  // and between objects and walls
};

/// Poses with times, the cheapest found by m0 l0 + w sum(mi li); empty without a plan. It leads
/// ahead only, and turns on the spot at the end. All arrays but `objects` are (N,).
struct Plan {
  PlanStatus status = PlanStatus::kNoPlan;
  std::string message{};
  std::vector<double> times{};       // from the start [s]
  std::vector<Pose> poses{};         // of the robot
  std::vector<double> lengths{};     // path length so far [m]
  std::vector<double> speeds{};      // from each pose on [m/s]; 0 where the robot turns on the spot
  std::vector<double> turn_rates{};  // [rad/s]
  std::vector<Pose> objects{};       // (N, K) their predicted centroids, and turns since the start
  double travel_cost = 0.0;          // m0 l0 [kg m]
  double interaction_cost = 0.0;     // sum(mi li) [kg m]
  /// Heading of the goal that a differential drive turns to at the end [rad], if it has one.
  double last_heading = std::numeric_limits<double>::quiet_NaN();

  /// The path as controllers read it; the plan has to outlive it.
  mpc::ReferencePath track() const;
};

/// The best plan found within the budget. It throws nothing, whatever the arguments are.
Plan plan(const World& world, const PlannerOptions& options = {});

/// Controllers with the usual settings, for a robot that `plan` accepts.
PurePursuit make_pure_pursuit(const Robot& robot, const mpc::Twist& driven = {0.0, 0.0});
mpc::Tracker make_tracker(const Robot& robot, const mpc::Twist& driven = {0.0, 0.0},
                          double delay = 0.0);  // between a command and its effect [s]

}  // namespace pushplan
