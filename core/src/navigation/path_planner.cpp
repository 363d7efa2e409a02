#include <cmath>

#include "path_searches.hpp"
#include "pushplan/motion/length_bound.hpp"
#include "pushplan/motion/speed_profile.hpp"

namespace pushplan {
namespace {

constexpr double kWeightSpread = 0.7;   // of the weight of pushing from round to round
constexpr double kLargeTurn = 0.5;      // on the spot, from which on arcs without it are a detour [rad]
constexpr double kPatience = 20.0;      // times the usual rounds of the contact solver
constexpr int kCurveTries = 4;          // along the shortest path; the last ones turn most sharply
constexpr double kRounding = 1e-6;      // by which a plan's rates may exceed a limit

/// Least turning radius of plans [m], as long as there is a way with it.
double first_radius(const Scene& scene) {
  const Robot& robot = scene.robot();
  const PlannerOptions& options = scene.options;
  if (!robot.turns_on_spot()) {
    return std::max(robot.least_radius() / options.turn_fraction, kTightest * scene.size);
  }
  const bool push_aware = options.search == SearchKind::kPushAware;
  return (push_aware ? options.differential_radius : 1.0) * scene.size;
}

}  // namespace

/// All that a planning call holds, and what it does, as one task.
struct PathPlanner::Call {
  Call(World world, const PlannerOptions& options, std::unique_ptr<Pushing> given)
      : scene(std::move(world), options),
        own(scene.bodies(), scene.settings(options.contact.iterations)),
        is_own(!given),
        pushing(given ? std::move(given) : std::make_unique<PushingWith<QuasiStatic>>(own)),
        session{scene, *pushing, Random(options.seed)},
        improver(session, {scene.keep_out, scene.world.robot_pose, scene.poses, scene.world.goal},
                 first_radius(scene)),
        trees(improver),
        searches(improver),
        work(run()) {
    session.pauses.begin(work.handle());
  }

  Task<void> run();
  Task<bool> first_plan();
  LengthBound length_bound() const;
  Task<void> find_bound();
  Task<void> search();
  Task<void> turn_first(bool has_table);
  Task<void> shortest_path();
  Task<void> set_aside_drive();
  Task<void> one_round();
  /// The improver whose best path is the plan.
  const PathImprover& planned() const {
    return !improver.solved() && spare && spare->solved() ? *spare : improver;
  }

  Scene scene;
  QuasiStatic own;
  bool is_own;
  std::unique_ptr<Pushing> pushing;
  Session session;
  PathImprover improver;
  TreePaths trees;
  PathSearches searches;
  std::optional<QuasiStatic> patient{};  // contacts of the path that is set aside
  std::unique_ptr<Pushing> patient_pushing{};
  std::optional<PathImprover> spare{};  // its path is the plan if no other one is found
  PlanStatus status = PlanStatus::kNoPlan;
  double bound = 0.0;
  Task<void> work;
};

Task<void> PathPlanner::Call::run() {
  const std::optional<PlanStatus> begun = improver.begin();
  session.pauses.change();
  co_await session.pauses.point();
  const Pose& start = scene.world.robot_pose;
  if (begun) {
    status = *begun;
  } else if (improver.has_pose_goal() && improver.problem().goal.contains({start.x, start.y})) {
    std::vector<Arc> none;  // it may only have to turn
    co_await improver.drives(std::move(none));
  }
  if (begun || improver.solved()) {
    co_await find_bound();
  } else if (scene.options.search == SearchKind::kShortestPath) {
    co_await shortest_path();
  } else {
    co_await search();
  }
}

/// Drives along the shortest path or, where that fails, grows trees until one has a plan. False where
/// the call ends here.
Task<bool> PathPlanner::Call::first_plan() {
  co_await trees.look_ahead();
  co_await warm_start(improver);
  if (!improver.solved()) co_await set_aside_drive();
  while (!trees.boxed_in()) {
    co_await one_round();
    if (improver.solved()) co_return true;
    if (trees.sealed()) break;
    co_await trees.change_start();
    if (!improver.lead().arcs.empty()) {
      co_await warm_start(improver);
      if (improver.solved()) co_return true;
    }
    trees.relax();
    if (improver.relaxed() != 1) co_await warm_start(improver);  // else nothing is new
    const bool useful = co_await searches.make_table();
    if (!useful) continue;
    trees.relax();  // where a first tree fails, the start is most often a tight one
    co_await searches.search(kUnsolvedRatio);
  }
  status = trees.boxed_in() ? PlanStatus::kStartBlocked : PlanStatus::kGoalUnreachable;
  co_return false;
}

Task<void> PathPlanner::Call::search() {
  bound = length_bound().cost();  // without walls, in no time; the rest waits for the first plan
  const bool found = co_await first_plan();
  co_await find_bound();
  if (!found) co_return;
  const bool useful = co_await searches.make_table();
  if (useful) co_await searches.search();
  co_await turn_first(useful);
  for (;;) {
    if (useful) co_await searches.search_at_random();
    co_await one_round();
    co_await one_round();
  }
}

/// Tries paths that begin with a turn on the spot, and goes on with them if they cost less.
Task<void> PathPlanner::Call::turn_first(bool has_table) {
  if (!improver.lead().arcs.empty() || !scene.options.uses(Part::kTurnFirst)) co_return;
  std::optional<Lead> lead = co_await trees.start_turn(improver.lead());
  if (!lead || lead->arcs[0].length < kLargeTurn) co_return;
  const double before = improver.best_cost();
  improver.begin_with(std::move(lead));
  co_await warm_start(improver);
  if (has_table) co_await searches.search();
  co_await one_round();
  co_await one_round();
  if (!(improver.best_cost() < before)) improver.begin_with(std::nullopt);
}

/// The path of a tree among the objects, at a weight of pushing that varies.
Task<void> PathPlanner::Call::one_round() {
  double weight = scene.options.push_weight;
  if (session.counts.trees > 0) weight *= std::exp(kWeightSpread * session.random.normal());
  std::optional<Candidate> candidate = co_await trees.grow(weight);
  if (candidate) co_await improver.work_out(*candidate);
}

Task<void> PathPlanner::Call::shortest_path() {
  for (int i = 0; i < kCurveTries; ++i) {
    const bool found = co_await along_guide(improver);
    if (found) co_return;
    improver.relax();
  }
}

/// Sets aside a drive along the shortest path through all objects, for want of another plan. The
/// contact solver runs so long that only a wall can hold an overlap that it leaves: in a crowd, or
/// where objects overlap at the start, its usual rounds end before they are apart.
Task<void> PathPlanner::Call::set_aside_drive() {
  if (!is_own || !scene.options.uses(Part::kPatientDrive)) co_return;
  if (!patient) {
    const auto rounds = static_cast<Index>(kPatience * static_cast<double>(scene.options.contact.iterations));
    patient.emplace(scene.bodies(), scene.settings(rounds));
    patient_pushing = std::make_unique<PushingWith<QuasiStatic>>(*patient);
  }
  spare.emplace(improver, *patient_pushing);
  const bool found = co_await along_guide(*spare);
  if (!found) spare.reset();
}

LengthBound PathPlanner::Call::length_bound() const {
  const Robot& robot = scene.robot();
  const bool turns = robot.turns_on_spot() || robot.reverses();  // or goes back at first
  const double radius = turns ? 0.0 : std::max(robot.least_radius(), kTightest * scene.size);
  return {*scene.keep_out, scene.world.robot_pose, scene.world.goal,
          robot.mass,      scene.inscribed,        radius};
}

Task<void> PathPlanner::Call::find_bound() {
  LengthBound least = length_bound();
  while (!least.run()) co_await session.pauses.point();
  bound = least.cost();
}

PathPlanner::PathPlanner(World world, const PlannerOptions& options)
    : PathPlanner(std::move(world), options, nullptr) {}

PathPlanner::PathPlanner(World world, const PlannerOptions& options,
                         std::unique_ptr<Pushing> pushing)
    : call_(std::make_unique<Call>(std::move(world), options, std::move(pushing))) {}

PathPlanner::~PathPlanner() = default;

void PathPlanner::run(Index budget) {
  const Index begun = counts().iterations;
  do {
    if (done()) break;
    call_->session.pauses.resume();
  } while (counts().iterations - begun < budget);
  if (done()) call_->work.await_resume();  // throws what it has thrown
}

bool PathPlanner::done() const { return call_->work.handle().done(); }

double PathPlanner::cost() const { return call_->improver.plan_cost(); }

double PathPlanner::bound() const { return call_->bound; }

const PlannerCounts& PathPlanner::counts() const {
  call_->session.counts.tight = call_->planned().tight();
  return call_->session.counts;
}

PlanStatus PathPlanner::status() const {
  return call_->planned().solved() ? PlanStatus::kSolved : call_->status;
}

Plan PathPlanner::best() const {
  Plan found{status()};
  const Scene& scene = call_->scene;
  const Robot& robot = scene.robot();
  const PathImprover& improver = call_->planned();
  if (!improver.solved()) return found;
  const SweptPath& path = *improver.best();
  const auto count = static_cast<std::size_t>(path.count);
  found.poses.assign(path.used().begin(), path.used().end());
  found.objects.reserve(count * scene.object_count());
  for (Index n = 0; n < path.count; ++n) {
    const auto objects = path.objects_at(n);
    found.objects.insert(found.objects.end(), objects.begin(), objects.end());
  }
  found.lengths.assign(path.lengths.begin(), path.lengths.begin() + path.count);
  for (std::size_t i = 1; i < count && !scene.world.prices.values.empty(); ++i) {
    const double dx = path.poses[i].x - path.poses[i - 1].x;  // in `path` a metre counts by its price
    const double dy = path.poses[i].y - path.poses[i - 1].y;
    found.lengths[i] = found.lengths[i - 1] + std::sqrt(dx * dx + dy * dy);  // as `ArcRollout` does
  }
  found.travel_cost = robot.mass * found.lengths.back();
  found.interaction_cost = path.works[count - 1];
  found.cost = improver.best_cost();
  if (robot.drive == Drive::kDifferential) found.last_heading = scene.world.goal.heading;
  const Pose& twist = scene.world.robot_twist;
  const double theta = scene.world.robot_pose.theta;
  const SpeedLimits limits{scene.size,
                           robot.max_speed,
                           robot.min_speed,
                           scene.options.turn_fraction * robot.max_turn_rate,
                           robot.max_acceleration,
                           robot.max_turn_acceleration,
                           robot.can_stop(),
                           twist.x * std::cos(theta) + twist.y * std::sin(theta),
                           twist.theta};
  found.times.resize(count);
  found.speeds.resize(count);
  found.turn_rates.resize(count);
  const SpeedProfile profile{found.times, found.speeds, found.turn_rates};
  if (robot.slides()) {
    fill_sliding_profile(found.poses, limits, {twist.x, twist.y}, profile);
  } else {
    std::vector<double> chords;
    for (std::size_t i = 1; i < count; ++i) chords.push_back(found.lengths[i] - found.lengths[i - 1]);
    fill_speed_profile({found.poses, std::span(path.curvatures).first(count)}, chords, limits, profile);
  }
  const double fastest = turn_acceleration(found.turn_rates, found.times);
  if (!robot.can_stop() && fastest > robot.max_turn_acceleration * (1.0 + kRounding)) {
    found.status = PlanStatus::kPathOnly;
  }
  return found;
}

}  // namespace pushplan
