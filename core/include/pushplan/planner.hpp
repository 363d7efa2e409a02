// Planning calls: a path to the goal that weighs its length against what it pushes.
//
// Plans minimise m0 l0 + w sum(mi li), with the lengths that the quasi-static model predicts. They
// lead ahead only. No input leads to an exception or to undefined behaviour.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pushplan/control/mpc/tracking.hpp"
#include "pushplan/world.hpp"

namespace pushplan {

enum class SearchKind {
  kKinodynamic,  // random trees of arcs, around the objects and through them: the quicker one
  kPushAware     // best-first searches and random trees that carry the objects along
};

enum class PlanStatus {
  kSolved,
  kInvalidInput,  // `message` says what is wrong
  kStartBlocked,  // the robot overlaps a wall, or is out of the bounds
  kNoPlan,        // none was found within the budget
  kFailed         // memory ran out, or the stop rule threw; see `message`
};

struct PlannerOptions {
  SearchKind search = SearchKind::kPushAware;
  std::uint64_t seed = 0;        // the same one gives the same plan, without a stop rule
  Index iterations = 20'000;     // edges, expanded nodes and shortcuts until the call ends
  std::function<bool()> stop;    // asked every few milliseconds; ends the call where it is true
  double push_weight = 2.5;      // w
  double margin = 0.08;          // clearance kept from walls [circumscribed radii], at first
  double turn_fraction = 0.9;    // of the greatest turn rate; the rest is for tracking
  double friction = 0.1;         // Coulomb coefficient between robot and objects
  double static_friction = 0.5;  // and between objects and walls
};

/// Poses with times. Every array but `objects` has N elements; all are empty without a plan.
struct Plan {
  PlanStatus status = PlanStatus::kNoPlan;
  std::string message{};
  std::vector<double> times{};       // from the start [s]
  std::vector<Pose> poses{};         // of the robot
  std::vector<double> lengths{};     // path length so far [m]
  std::vector<double> speeds{};      // from each pose on [m/s]
  std::vector<double> turn_rates{};  // [rad/s]
  std::vector<Pose> objects{};       // (N, K) where they are predicted, pose by pose
  double travel_cost = 0.0;          // m0 l0 [kg m]
  double interaction_cost = 0.0;     // sum(mi li) [kg m]

  /// The path as controllers read it; the plan has to outlive it.
  mpc::ReferencePath track() const { return {poses, lengths, speeds}; }
};

/// Plans from a world. The best plan so far is returned when the budget is used up.
Plan plan(const World& world, const PlannerOptions& options = {});

}  // namespace pushplan
