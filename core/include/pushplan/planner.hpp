// The cheapest path to the goal, by its length and by what it pushes: one planner for all doors.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "pushplan/control/mpc/tracker.hpp"
#include "pushplan/control/pure_pursuit.hpp"
#include "pushplan/world.hpp"

namespace pushplan {

class Pushing;

enum class SearchKind {
  kShortestPath,  // along the shortest path around the walls, or nothing
  kKinodynamic,   // random trees: the first plan sooner
  kPushAware      // best-first searches: better plans
};

enum class PlanStatus {
  kSolved,
  kPathOnly,         // the robot cannot change its turn rate as fast as the plan does
  kInvalidInput,     // `message` says what is wrong
  kStartBlocked,     // the robot overlaps a wall, is out of the bounds, or cannot get away
  kGoalUnreachable,  // no way leads to the goal around the walls
  kNoPlan,           // none was found within the budget
  kFailed            // memory ran out, or the stop rule threw
};

/// Prediction of pushed objects, as `QuasiStatic` does it.
struct ContactOptions {
  double friction = 0.1;         // Coulomb coefficient between robot and objects
  double static_friction = 0.5;  // and between objects and walls
  double gyration_scale = 1.0;   // on the radius of the limit surfaces
  double step = 0.1;             // of the robot, in half diagonals of the thinnest body
  Index iterations = 12;         // rounds of the solver
};

/// Parts of the planner that can be left out, to see what each is worth.
enum class Part : unsigned {
  kGuidedDrive = 1,   // along the shortest path
  kWindows = 2,       // of a far way, in which a tree grows where that drive fails
  kPatientDrive = 4,  // through everything, for want of another plan
  kTrees = 8,
  kCoarsePath = 16,  // about which they grow
  kSearches = 32,    // over a table of lengths to the goal
  kVariants = 64,    // of searches: other edges, inflations and masses
  kTurnFirst = 128,  // on the spot
  kWaysOut = 256     // of a start where no arc leads on
};

struct PlannerOptions {
  SearchKind search = SearchKind::kPushAware;
  std::uint64_t seed = 0;     // the same one gives the same plan, unless a callback ends the call
  double push_weight = 2.5;   // w
  double margin = 0.08;       // clearance from walls where there is room [circumscribed radii]
  double turn_fraction = 0.98;        // of the greatest turn rate; the rest is for tracking
  double differential_radius = 1.0;   // of `kPushAware`, turns of robots that turn on the spot [R]
  double heuristic_inflation = 1.05;  // of the length to go, in the order of the first search
  double pruning_factor = 0.92;       // on that length, where a path is given up
  ContactOptions contact{};
  unsigned without = 0;  // sum of parts

  bool uses(Part part) const { return (without & static_cast<unsigned>(part)) == 0; }
};

/// Poses with times, the cheapest found by m0 l0 + w sum(mi li); empty without a plan. All arrays
/// but `objects` are (N,).
struct Plan {
  PlanStatus status = PlanStatus::kNoPlan;
  std::string message{};
  std::vector<double> times{};       // from the start [s]
  std::vector<Pose> poses{};         // of the robot
  std::vector<double> lengths{};     // path length so far [m]
  std::vector<double> speeds{};      // from each pose on [m/s]; 0 where the robot turns on the spot
  std::vector<double> turn_rates{};  // [rad/s]
  std::vector<Pose> objects{};       // (N, K) where they are predicted to be
  double travel_cost = 0.0;          // m0 l0 [kg m]
  double interaction_cost = 0.0;     // sum(mi li) [kg m]
  double cost = 0.0;                 // with the weight of pushing, and prices [kg m]
  /// Heading of the goal that a differential drive turns to at the end [rad], if it has one.
  double last_heading = std::numeric_limits<double>::quiet_NaN();

  /// The path as controllers read it; the plan has to outlive it.
  mpc::ReferencePath track() const;
};

/// What a planning call has done.
struct PlannerCounts {
  Index iterations = 0;   // edges, nodes and shortcuts
  Index nodes = 0;        // that were part of the paths looked at closer
  Index trees = 0;        // grown
  Index searches = 0;     // begun
  Index expansions = 0;   // arcs that they drove
  bool tight = false;     // the best plan turns tighter, or keeps less margin, than was asked for
};

/// A planning call that works in pieces. It keeps the best plan, and goes on for as long as it is
/// asked to: waiting longer never costs more.
class PathPlanner {
 public:
  /// A world and options with no fault (`fault_of`).
  PathPlanner(World world, const PlannerOptions& options);
  /// The same with a model other than `QuasiStatic`, which has to outlive the planner.
  PathPlanner(World world, const PlannerOptions& options, std::unique_ptr<Pushing> pushing);
  ~PathPlanner();

  /// Works until so many iterations more are done, or all is; 0: to the next place to pause,
  /// which is after some iterations, a better plan, or about half a millisecond.
  void run(Index budget);

  bool done() const;
  PlanStatus status() const;
  double cost() const;   // of the best plan [kg m]; infinite without one, or with none but the drive
                         // that is set aside for want of another
  double bound() const;  // which no plan can undercut [kg m], once it is known
  const PlannerCounts& counts() const;
  /// The best plan so far.
  Plan best() const;

 private:
  struct Call;
  std::unique_ptr<Call> call_;
};

/// What is wrong with a world or options; empty if nothing is.
std::string fault_of(const World& world, const PlannerOptions& options);

/// The best plan found within so many iterations, or until `stop`, asked every half millisecond, is
/// true. It throws nothing, whatever the arguments are.
Plan plan(const World& world, const PlannerOptions& options = {}, Index iterations = 20'000,
          const std::function<bool()>& stop = {});

/// Controllers with the usual settings, for a robot that `plan` accepts.
PurePursuit make_pure_pursuit(const Robot& robot, const mpc::Twist& driven = {0.0, 0.0});
mpc::Tracker make_tracker(const Robot& robot, const mpc::Twist& driven = {0.0, 0.0},
                          double delay = 0.0);  // between a command and its effect [s]

}  // namespace pushplan
