#include "pushplan/planner.hpp"

#include <array>
#include <cmath>
#include <exception>
#include <optional>
#include <random>
#include <tuple>
#include <utility>

#include "planner_scene.hpp"
#include "pushplan/motion/goal_approach.hpp"
#include "pushplan/motion/shortcutting.hpp"
#include "pushplan/motion/speed_profile.hpp"
#include "pushplan/planners/push_aware/best_first.hpp"
#include "pushplan/planners/push_aware/random_tree.hpp"

namespace pushplan {
namespace {

// Many of these are those of the planners in Python, which say why. R: the robot's size.
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kInset = 0.05;          // depth in the goal at which a plan ends [R]
constexpr double kNear = 0.5;            // tolerance of that place [that of the goal, or R]
constexpr double kSpacing = 0.15;        // distance between the poses of a path [R]
constexpr double kLeastSpacing = 0.02;   // the same where the margin is thin [R]
constexpr double kTightest = 0.1;        // least turning radius that plans use [R]
constexpr double kBeyond = 1e4;          // times the way around the workspace: no path is as long
constexpr double kDetour = 2.0;          // length of a first path, in lengths to go
constexpr double kLongestArc = 2.0;      // of random trees [R]
constexpr double kNearPath = 0.8;        // of the targets of trees lie near the coarse path
constexpr double kSpread = 0.5;          // standard deviation of those about it [R]
constexpr double kTurnSpread = 0.4;      // [rad]
constexpr double kLeastGain = 0.001;     // of a path's cost over a round of shortcuts
constexpr double kHopefulGains = 5.0;    // such gains in which a path may become the best
constexpr Index kShortcuts = 400;        // a round
constexpr Index kNodes = 100'000;        // of one search at most
constexpr Index kTreeNodes = 5'000;      // of a random tree; then another is begun
constexpr double kMemory = 48.0;         // of the objects' poses in a search at most [MiB]
constexpr Index kPatience = 1'000;       // arcs that the first search drives
constexpr double kEdge = 2.0;            // of a search [cells of the table]
constexpr double kInflation = 1.05;      // of the length to go
constexpr double kPruning = 0.92;        // on that length, where a node is given up
constexpr double kSlack = 1.05;          // cost of a path of the search over that of the best
constexpr double kMassSpread = 0.7;      // of masses from search to search: of their logarithm
constexpr double kRandomFraction = 0.1;  // of the iterations of the push-aware search
constexpr double kMostPoses = 1e6;       // of a path

/// A path that owns its memory.
struct OwnPath {
  OwnPath(std::size_t capacity, std::size_t objects_count)
      : poses(capacity),
        curvatures(capacity),
        objects(capacity * objects_count),
        lengths(capacity),
        works(capacity),
        shape{static_cast<Index>(capacity), static_cast<Index>(objects_count)} {}

  SweptPath view() { return {poses, curvatures, {objects.data(), shape}, lengths, works}; }

  std::vector<Pose> poses;
  std::vector<double> curvatures;
  std::vector<Pose> objects;
  std::vector<double> lengths;
  std::vector<double> works;
  ArrayView<Pose, 2>::Shape shape;
};

class PlanningCall {
 public:
  PlanningCall(const World& world, const PlannerOptions& options)
      : options_(options),
        scene_(world),
        robot_(world.robot),
        start_(world.robot_pose),
        size_(scene_.size),
        model_(scene_.bodies(), scene_.settings(options)),
        batch_(std::max<std::size_t>(1, 100 / (10 + scene_.poses.size()))),
        random_(options.seed) {}

  Plan run();

 private:
  bool stopped() {
    stopped_ = stopped_ || iterations_ >= options_.iterations || (options_.stop && options_.stop());
    return stopped_;
  }
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double normal() {  // Box and Muller (1958): the same from every standard library
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  bool solved() const { return best_cost_ < kInfinity; }

  bool set_margin(double margin);
  void set_goal();
  bool end_at_goal(OwnPath& path, Index& count);
  EndTurns end_turns() const {
    return {robot_.drive == Drive::kDifferential, false, problem_.turning_radius, problem_.spacing};
  }
  PathProblem path_problem() const {  // of whole paths; searches lead to where their ends begin
    PathProblem whole = problem_;
    whole.goal = path_goal_;
    return whole;
  }
  void set_radius(double radius) { problem_.turning_radius = std::max(radius, kTightest * size_); }
  void find_coarse_path(const CostToGo& table);
  GrowthDraw draw_growth(double bound);
  void grow_trees(Index upto);
  void search_table(const CostToGo& table);
  void try_arcs(const std::vector<Arc>& arcs);
  void shortcut_path(OwnPath& path, PricedPath priced);
  void keep(const OwnPath& path, const PricedPath& priced);
  Plan finish() const;

  const PlannerOptions& options_;
  Scene scene_;
  const Robot& robot_;
  Pose start_;
  double size_;
  QuasiStatic model_;
  std::size_t batch_;  // shortcuts between two looks at the stop rule
  std::mt19937_64 random_;
  Index iterations_ = 0;
  bool stopped_ = false;
  Outlines footprint_;
  PathProblem problem_{};
  GoalRegion path_goal_;
  double straight_ = 0.0;  // length of the way into the pose of the goal [m]
  std::vector<Pose> coarse_path_;
  double to_go_ = kInfinity;  // length to the goal without objects [m]
  double detour_ = kDetour;
  std::optional<PushTree> search_tree_;
  std::optional<PushTree> random_tree_;
  double patience_ = static_cast<double>(kPatience);
  std::optional<OwnPath> best_;
  Index best_count_ = 0;
  double best_cost_ = kInfinity;
};

/// Sets where searches lead: into the goal, or near the place from which a path ends at its
/// heading, which is the pose itself, or where a straight way into it begins.
void PlanningCall::set_goal() {
  problem_.goal = path_goal_ = scene_.goal(kInset * size_);
  const GoalRegion& goal = scene_.world.goal;
  if (!goal.has_heading()) return;
  CollisionChecker checker({scene_.robot.polygons(), size_}, problem_.walls);
  straight_ = run_up(goal, end_turns(), size_, checker);
  const Pose begin = behind(goal, straight_);
  const double near = kNear * (straight_ == 0.0 ? goal.radius : size_);
  problem_.goal = {GoalRegion::Kind::kDisc, {begin.x, begin.y}, {}, std::max(near, size_)};
  path_goal_ = problem_.goal;
  path_goal_.radius = near;
  path_goal_.heading = goal.heading;
  path_goal_.turns = end_turns().on_spot && straight_ == 0.0;
}

/// Gives a path an end at the heading of the goal; false where there is none.
bool PlanningCall::end_at_goal(OwnPath& path, Index& count) {
  CollisionChecker checker(problem_.footprint, problem_.walls);
  const std::span<const Pose> poses = std::span(path.poses).first(static_cast<std::size_t>(count));
  const auto end = path_end(scene_.world.goal, poses, end_turns(), straight_, checker);
  if (!end) return false;
  const auto kept = static_cast<std::size_t>(end->kept);
  OwnPath other(3 * (kept + end->poses.size()) + 200, scene_.poses.size());
  std::ranges::copy(poses.first(kept), other.poses.begin());
  std::ranges::copy(std::span(path.curvatures).first(kept), other.curvatures.begin());
  std::ranges::copy(end->poses, other.poses.begin() + end->kept);
  std::ranges::copy(end->curvatures, other.curvatures.begin() + end->kept);
  count = end->kept + static_cast<Index>(end->poses.size());
  path = std::move(other);
  return true;
}

/// Keeps a margin from walls [R]. False if the robot, or the pose of its goal, is nearer to one.
bool PlanningCall::set_margin(double margin) {
  footprint_ = scene_.footprint(margin * size_);
  problem_.footprint = {footprint_.polygons(), footprint_.radius()};
  problem_.spacing = std::min(kSpacing, std::max(2.0 * margin, kLeastSpacing)) * size_;
  CollisionChecker checker(problem_.footprint, problem_.walls);
  const GoalRegion& goal = scene_.world.goal;
  return checker.is_free(start_) && (!goal.has_heading() || checker.is_free(behind(goal, 0.0)));
}

Plan PlanningCall::run() {
  const Box& bounds = scene_.world.bounds;
  const double around = bounds.x_max - bounds.x_min + bounds.y_max - bounds.y_min + size_;
  double load = 1.0;
  for (const double mass : scene_.masses) load += options_.push_weight * mass / robot_.mass;
  problem_.robot_mass = robot_.mass;
  problem_.push_weight = options_.push_weight;
  problem_.jam_length = kBeyond * around * load;
  problem_.displacement = 1.5 * size_;
  problem_.walls = scene_.obstacles();
  set_radius(robot_.drive == Drive::kDifferential ? size_
                                                  : scene_.turning_radius / options_.turn_fraction);
  constexpr std::array<double, 5> kParts{1.0, 0.5, 0.25, 0.1, 0.0};  // of the margin
  if (std::ranges::none_of(kParts, [&](double p) { return set_margin(p * options_.margin); })) {
    if (CollisionChecker(problem_.footprint, problem_.walls).is_free(start_)) {
      return {PlanStatus::kNoPlan, "the pose of the goal overlaps a wall, or is out of the bounds"};
    }
    return {PlanStatus::kStartBlocked, "the robot overlaps a wall, or is out of the bounds"};
  }
  set_goal();
  if (scene_.world.goal.contains({start_.x, start_.y})) try_arcs({});
  if (solved()) return finish();
  const bool push_aware = options_.search == SearchKind::kPushAware;
  const Footprint bare{scene_.robot.polygons(), size_};
  CostToGoMaker maker(bare, problem_.walls, problem_.goal, size_, problem_.turning_radius,
                      push_aware ? CostToGoMaker::kHeadings : 8);
  while (!maker.done() && (push_aware || !maker.flooded()) && !stopped()) maker.step();
  const CostToGo table = maker.table();
  if (maker.useful() && maker.flooded()) find_coarse_path(table);
  to_go_ = table.length_to_go(start_);
  if (!(to_go_ < kInfinity)) to_go_ = around;
  for (int round = 0; !stopped(); ++round) {
    const Index begun = iterations_;
    if (push_aware && maker.useful() && maker.done()) search_table(table);
    const auto searched = static_cast<double>(iterations_ - begun);
    const bool shared = solved() && push_aware && searched > 0.0;  // with searches of the table
    grow_trees(shared ? std::max<Index>(1, static_cast<Index>(kRandomFraction * searched))
                      : kTreeNodes);
    if (solved() || round < 1) continue;
    detour_ *= 1.5;  // the way may be longer, or begin with a tight turn
    set_radius(robot_.drive == Drive::kDifferential ? 0.5 * problem_.turning_radius
                                                    : scene_.turning_radius);
  }
  return finish();
}

/// Follows the floor of the table downhill.
void PlanningCall::find_coarse_path(const CostToGo& table) {
  Index row = table.row_of(start_.y);
  Index column = table.column_of(start_.x);
  while (table.floor(row, column) > 0.0) {
    const Vec2 from = table.cells.centre(row, column);
    std::tuple least{table.floor(row, column), row, column};
    for (Index r = std::max(row - 1, Index{0}); r <= std::min(row + 1, table.rows() - 1); ++r) {
      const Index last = std::min(column + 1, table.columns() - 1);
      for (Index c = std::max(column - 1, Index{0}); c <= last; ++c) {
        least = std::min(least, std::tuple{table.floor(r, c), r, c});
      }
    }
    if (least >= std::tuple{table.floor(row, column), row, column}) return;
    std::tie(std::ignore, row, column) = least;
    const Vec2 to = table.cells.centre(row, column);
    coarse_path_.push_back({to.x, to.y, std::atan2(to.y - from.y, to.x - from.x)});
  }
}

/// A random arc: mostly towards a place near the coarse path, sometimes anywhere.
GrowthDraw PlanningCall::draw_growth(double bound) {
  GrowthDraw draw{uniform(), uniform(), uniform(), uniform(), uniform(), uniform()};
  if (coarse_path_.empty() || uniform() >= kNearPath) return draw;
  const double part = uniform();
  const auto i = static_cast<std::size_t>(part * static_cast<double>(coarse_path_.size()));
  const Pose& at = coarse_path_[i];
  const Box& box = scene_.world.bounds;
  const double heading = at.theta + kTurnSpread * normal();
  draw.x = (at.x + kSpread * size_ * normal() - box.x_min) / (box.x_max - box.x_min);
  draw.y = (at.y + kSpread * size_ * normal() - box.y_min) / (box.y_max - box.y_min);
  draw.heading = floor_mod(heading / (2.0 * std::numbers::pi), 1.0);
  draw.cost = std::min(part * robot_.mass * to_go_ / bound, 1.0);
  return draw;
}

/// Adds arcs to a random tree that carries the objects along, and tries what gets to the goal.
void PlanningCall::grow_trees(Index arcs) {
  if (!random_tree_) {
    random_tree_.emplace(kTreeNodes, scene_.poses.size(), kMemory, PushTree::CellShape{});
    random_tree_->plant(start_, scene_.poses, 0.0);
  }
  const GrowthScales scales{2.0 * size_, std::numbers::pi, 2.0 * size_ * robot_.mass};
  std::vector<GrowthDraw> draws(3 * batch_);
  const Index last = iterations_ + arcs;
  while (iterations_ < last && !stopped()) {
    const double bound = std::min(best_cost_, detour_ * robot_.mass * to_go_);
    for (GrowthDraw& draw : draws) draw = draw_growth(bound);
    const Growth found =
        grow(*random_tree_, draws, bound, kLongestArc * size_, scales, problem_, model_);
    iterations_ += static_cast<Index>(draws.size());
    if (found.status == Growth::Status::kGoing) continue;
    if (found.node >= 0) try_arcs(random_tree_->arcs_to(found.node));
    random_tree_->plant(start_, scene_.poses, 0.0);
  }
}

/// One best-first search below the best cost, with other edges and masses each time.
void PlanningCall::search_table(const CostToGo& table) {
  const bool first = !search_tree_;
  if (first) {
    const PushTree::CellShape cells{table.rows(), table.columns(), table.headings(), 1};
    search_tree_.emplace(kNodes, scene_.poses.size(), kMemory, cells);
  }
  PushTree& tree = *search_tree_;
  tree.plant(start_, scene_.poses, 0.0);
  const int turns = first ? 2 : 1 + static_cast<int>(3.0 * uniform());  // to each side
  std::vector<double> curvatures;
  for (int i = -turns; i <= turns; ++i) {
    curvatures.push_back(i / (turns * problem_.turning_radius));
  }
  std::vector<double> masses = scene_.masses;
  for (double& mass : masses) mass *= first ? 1.0 : std::exp(kMassSpread * normal());
  const double length = kEdge * table.cells.step * (first ? 1.0 : 0.7 + 0.8 * uniform());
  // among many objects the rest of a path costs more than its length too
  const double ratio = solved() ? best_cost_ / (robot_.mass * to_go_) : 1.3;
  const double most = std::min(std::max(ratio, kInflation), 2.0);
  const double inflation = first ? most : kInflation + (most - kInflation) * uniform();
  const Branching branching{curvatures, length, inflation, kPruning, masses};
  AStar<PushLattice<QuasiStatic>> search(
      {tree, table, branching, kSlack * best_cost_, problem_, model_}, 2 * kNodes);
  search.start(1);
  SearchStatus status = SearchStatus::kPaused;
  while (status == SearchStatus::kPaused && !tree.full && !stopped()) {
    const auto before = static_cast<double>(tree.driven);
    if (before >= patience_) break;
    status = search.run(static_cast<Index>(6 * batch_));
    iterations_ += std::max<Index>(1, tree.driven - static_cast<Index>(before));
  }
  if (status == SearchStatus::kPaused) patience_ *= 1.25;
  if (status == SearchStatus::kFound) try_arcs(tree.arcs_to(search.goal() >> 1));
}

/// Shortcuts the path along some arcs for as long as that pays, and it may still become the best.
void PlanningCall::try_arcs(const std::vector<Arc>& arcs) {
  double capacity = 200.0;  // shortcuts may take more poses
  for (const Arc& arc : arcs) {
    capacity += 3.0 * (arc.length / step_along(arc.curvature, problem_.spacing) + 1.0);
  }
  if (!(capacity < kMostPoses)) return;
  OwnPath path(static_cast<std::size_t>(capacity), scene_.poses.size());
  const PathProblem problem = path_problem();
  PricedPath priced{lay_out(start_, arcs, path.view(), problem), 0.0};
  const GoalRegion& goal = scene_.world.goal;
  const bool there = arcs.empty() && goal.reached_by(start_);
  if (goal.has_heading() && !there && !end_at_goal(path, priced.count)) return;
  std::ranges::copy(scene_.poses, path.objects.begin());
  PathSweep<QuasiStatic> sweep(problem, model_);
  const double jam = problem_.jam_length * robot_.mass;
  const auto step = static_cast<Index>(batch_);
  for (Index first = 0; first + 1 < priced.count; first += step) {
    const Index upto = std::min(first + step + 1, priced.count);
    priced.cost = sweep.cost(path.view(), first, upto, jam, std::numeric_limits<Index>::max());
    if (!(priced.cost < jam) || (upto < priced.count && stopped())) return;
  }
  keep(path, priced);
  shortcut_path(path, priced);
}

void PlanningCall::shortcut_path(OwnPath& path, PricedPath priced) {
  const PathProblem problem = path_problem();
  OwnPath trial(path.poses.size(), scene_.poses.size());
  std::vector<ShortcutDraw> draws(batch_);
  std::vector<ShortcutShift> shifts(batch_);
  double gain = kInfinity;
  while (gain > kLeastGain * priced.cost && priced.cost - best_cost_ <= kHopefulGains * gain) {
    const double before = priced.cost;
    for (Index done = 0; done < kShortcuts; done += static_cast<Index>(batch_)) {
      if (stopped()) return;
      for (ShortcutDraw& draw : draws) draw = {uniform(), uniform(), uniform(), uniform()};
      for (ShortcutShift& shift : shifts) shift = {normal(), normal()};
      priced = shortcut(path.view(), priced, draws, shifts, trial.view(), problem, model_);
      iterations_ += static_cast<Index>(batch_);
      keep(path, priced);
    }
    gain = before - priced.cost;
  }
}

void PlanningCall::keep(const OwnPath& path, const PricedPath& priced) {
  if (priced.cost >= best_cost_) return;
  best_ = path;
  best_count_ = priced.count;
  best_cost_ = priced.cost;
}

Plan PlanningCall::finish() const {
  if (!solved()) return {PlanStatus::kNoPlan, "no plan was found within the budget"};
  const auto count = static_cast<std::size_t>(best_count_);
  const auto first = [](const auto& all, std::size_t n) {
    return std::vector(all.begin(), all.begin() + static_cast<Index>(n));
  };
  const std::vector<double> numbers(count);
  Plan found{PlanStatus::kSolved, {}, numbers, first(best_->poses, count)};
  found.lengths = first(best_->lengths, count);
  found.speeds = found.turn_rates = numbers;
  found.objects = first(best_->objects, count * scene_.poses.size());
  found.travel_cost = robot_.mass * found.lengths.back();
  found.interaction_cost = best_->works[count - 1];
  if (end_turns().on_spot) found.last_heading = scene_.world.goal.heading;
  std::vector<double> chords;
  for (std::size_t i = 1; i < count; ++i) chords.push_back(found.lengths[i] - found.lengths[i - 1]);
  const mpc::Twist& driven = scene_.world.robot_twist;
  const SpeedLimits limits{size_,
                           robot_.max_speed,
                           0.0,
                           options_.turn_fraction * robot_.max_turn_rate,
                           robot_.max_acceleration,
                           robot_.max_turn_acceleration,
                           robot_.drive != Drive::kConstantSpeed,
                           driven.v,
                           driven.w};
  fill_speed_profile({found.poses, std::span(best_->curvatures).first(count)}, chords, limits,
                     {found.times, found.speeds, found.turn_rates});
  return found;
}

double size_of(const Robot& robot) {
  double size = 0.0;
  for (const Outline& part : robot.parts) {
    for (const Vec2 p : part) size = std::max(size, std::hypot(p.x, p.y));
  }
  return size;
}

mpc::CommandLimits limits_of(const Robot& robot) {
  return {robot.drive == Drive::kConstantSpeed,
          0.0,
          robot.max_speed,
          robot.max_turn_rate,
          robot.max_acceleration,
          robot.max_turn_acceleration,
          robot.turning_radius};
}

}  // namespace

Plan plan(const World& world, const PlannerOptions& options) {
  try {
    std::string fault = fault_of(world, options);
    if (!fault.empty()) return {PlanStatus::kInvalidInput, std::move(fault)};
    return PlanningCall(world, options).run();
  } catch (const std::exception& error) {
    return {PlanStatus::kFailed, error.what()};
  } catch (...) {
    return {PlanStatus::kFailed, "the stop rule threw something that is no std::exception"};
  }
}

mpc::ReferencePath Plan::track() const {
  std::size_t count = poses.size();
  while (count > 1 && lengths[count - 1] == lengths[count - 2]) --count;  // without a last turn
  return {std::span(poses).first(count), std::span(lengths).first(count),
          std::span(speeds).first(count), last_heading};
}

PurePursuit make_pure_pursuit(const Robot& robot, const mpc::Twist& driven) {
  return {limits_of(robot), size_of(robot), driven};
}

mpc::Tracker make_tracker(const Robot& robot, const mpc::Twist& driven, double delay) {
  const double size = size_of(robot);
  const mpc::Tuning tuning{size,
                           robot.max_speed,
                           robot.max_turn_rate,
                           robot.max_acceleration,
                           robot.drive != Drive::kConstantSpeed,
                           false};
  return {limits_of(robot), tuning, {}, 20, 3.0 * size / robot.max_speed, delay, driven};
}

}  // namespace pushplan
