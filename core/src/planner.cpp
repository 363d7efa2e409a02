#include "pushplan/planner.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

#include "pushplan/geometry/polygon.hpp"
#include "pushplan/motion/random_tree/steering.hpp"
#include "pushplan/motion/shortcutting.hpp"
#include "pushplan/motion/speed_profile.hpp"
#include "pushplan/planners/push_aware/best_first.hpp"
#include "pushplan/planners/push_aware/random_tree.hpp"
#include "scene.hpp"

namespace pushplan {
namespace {

// The same numbers as in the planners of the Python package, which has the reasons. R is the
// circumscribed radius of the robot.
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kInset = 0.05;          // depth in the goal at which a plan ends [R]
constexpr double kSpacing = 0.15;        // distance between the poses of a path [R]
constexpr double kLeastSpacing = 0.02;   // the same where the margin is thin [R]
constexpr double kThinMargin = 0.05;     // [R]
constexpr double kTightest = 0.1;        // least turning radius that plans ever use [R]
constexpr double kEdge = 1.6;            // longest edge of a tree [R]
constexpr double kBeyond = 1e4;          // times the way around the workspace, for a jam
constexpr double kNearCoarsePath = 0.8;  // of the targets, at first
constexpr double kTargetSpread = 0.5;    // standard deviation of those about it [R]
constexpr double kHeadingSpread = 0.4;   // [rad]
constexpr Index kAvoidIterations = 200;  // of the tree that takes objects as obstacles
constexpr Index kTreeIterations = 1500;  // of the tree that may push them
constexpr Index kShortcuts = 400;        // tried on a path before its gain is looked at
constexpr double kLeastGain = 0.001;     // of the cost over so many, for more of them
constexpr double kHopefulGains = 5.0;    // rounds with the last gain to become the best path
constexpr Index kNodes = 100'000;        // of one search at most
constexpr Index kRandomNodes = 20'000;   // of a random tree at most; then another is begun
constexpr double kMemory = 48.0;         // of the objects' poses in one search at most [MiB]
constexpr double kArc = 2.0;             // length of an edge of the search [cells of the table]
constexpr double kInflation = 1.05;      // of the length to go
constexpr double kUnsolvedInflation = 1.3;
constexpr double kPruning = 0.92;         // on that length, where a path is given up
constexpr double kSlack = 0.05;           // cost above the best that shortcuts may make up for
constexpr double kMassSpread = 0.7;       // from search to search, of the logarithm
constexpr double kRandomFraction = 0.03;  // of the iterations, for a random tree
constexpr Index kPatience = 1'000;        // arcs driven in one search at first
constexpr double kPatienceGrowth = 1.25;
constexpr Index kMostPoses = 1'000'000;  // of a path

/// A path that owns its memory, and what it costs.
struct Candidate {
  std::vector<Pose> poses;
  std::vector<double> curvatures;
  std::vector<Pose> objects;  // (M, K)
  std::vector<double> lengths;
  std::vector<double> works;
  Index object_count = 0;  // K
  Index count = 0;         // poses in use
  double cost = kInfinity;

  void resize(Index poses_count, Index k) {
    const auto m = static_cast<std::size_t>(poses_count);
    poses.resize(m);
    curvatures.assign(m, 0.0);
    objects.resize(m * static_cast<std::size_t>(k));
    lengths.assign(m, 0.0);
    works.assign(m, 0.0);
    object_count = k;
  }
  SweptPath view() {
    const auto m = static_cast<Index>(poses.size());
    return {poses, curvatures, {objects.data(), {m, object_count}}, lengths, works};
  }
};

class PlanningCall {
 public:
  PlanningCall(const World& world, const PlannerOptions& options)
      : world_(world),
        options_(options),
        scene_(world),
        model_(scene_.bodies(), scene_.settings(options.friction, options.static_friction)),
        random_(options.seed),
        size_(scene_.size) {}

  Plan run();

 private:
  bool stopped();
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double normal() {  // Box and Muller (1958): the same from every standard library
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  Index batch() const { return std::max(Index{1}, 100 / (10 + scene_.count())); }

  bool set_margin(double margin);
  void relax();
  PathProblem problem() const;
  bool solved() const { return best_.cost < kInfinity; }

  void make_table(bool whole);
  void find_coarse_path();
  Pose next_target();
  std::vector<Arc> grow_tree(const ConvexObstacles& among, Index budget);
  void grow_two();
  void search_table();
  void grow_at_random(Index arcs);
  void try_arcs(const std::vector<Arc>& arcs, double limit);
  void shortcut_candidate(Candidate& candidate);
  void keep(Candidate& candidate);
  Plan finish();

  const World& world_;
  const PlannerOptions& options_;
  Scene scene_;
  QuasiStatic model_;
  std::mt19937_64 random_;
  double size_;
  Index iterations_ = 0;
  bool stopped_ = false;
  double radius_ = 0.0;
  double margin_ = 0.0;
  double spacing_ = 0.0;
  double near_fraction_ = kNearCoarsePath;
  int relaxed_ = 0;
  std::optional<CostToGoMaker> table_;
  std::optional<PushTree> search_tree_;
  std::optional<PushTree> random_tree_;
  double patience_ = static_cast<double>(kPatience);
  std::vector<Pose> coarse_path_;
  Candidate best_;
};

bool PlanningCall::stopped() {
  stopped_ = stopped_ || iterations_ >= options_.iterations || (options_.stop && options_.stop());
  return stopped_;
}

/// Keeps a margin [m] from walls. False if the robot is nearer to one.
bool PlanningCall::set_margin(double margin) {
  margin_ = margin;
  scene_.grow_footprint(margin);
  spacing_ = kSpacing * size_;
  if (margin < kThinMargin * size_) {
    spacing_ = std::min(spacing_, std::max(2.0 * margin, kLeastSpacing * size_));
  }
  return CollisionChecker(scene_.grown_footprint(), scene_.walls()).is_free(world_.robot_pose);
}

/// Allows tighter turns from the second time on, and less margin from the fourth.
void PlanningCall::relax() {
  near_fraction_ *= 0.5;
  if (++relaxed_ < 2) return;
  if (relaxed_ >= 4) set_margin(0.4 * margin_);
  const Robot& robot = world_.robot;
  radius_ = robot.drive == Drive::kDifferential ? 0.5 * radius_ : scene_.turning_radius();
  radius_ = std::max(radius_, kTightest * size_);
}

PathProblem PlanningCall::problem() const {
  const double mass = world_.robot.mass;
  const Box& bounds = world_.bounds;
  const double around = bounds.x_max - bounds.x_min + bounds.y_max - bounds.y_min + size_;
  const double load = options_.push_weight * scene_.total_mass() / mass;
  return {mass,
          options_.push_weight,
          radius_,
          spacing_,
          kBeyond * around * (1.0 + load),
          1.5 * size_,
          scene_.goal(kInset * size_),
          scene_.grown_footprint(),
          scene_.walls()};
}

Plan PlanningCall::run() {
  radius_ = world_.robot.drive == Drive::kDifferential
                ? size_
                : std::max(scene_.turning_radius() / options_.turn_fraction, kTightest * size_);
  const std::array<double, 5> fractions{1.0, 0.5, 0.25, 0.1, 0.0};  // of the margin
  if (std::ranges::none_of(
          fractions, [&](double part) { return set_margin(part * options_.margin * size_); })) {
    return {PlanStatus::kStartBlocked, "the robot overlaps a wall or is out of the bounds"};
  }
  if (world_.goal.contains({world_.robot_pose.x, world_.robot_pose.y})) {
    try_arcs({}, kInfinity);
    return finish();
  }
  const bool push_aware = options_.search == SearchKind::kPushAware;
  make_table(push_aware);
  find_coarse_path();
  while (!stopped()) {
    const Index begun = iterations_;
    if (push_aware) search_table();
    grow_two();
    if (push_aware) {
      grow_at_random(
          static_cast<Index>(kRandomFraction * static_cast<double>(iterations_ - begun)));
    }
    if (!solved()) relax();
  }
  return finish();
}

/// Makes the table of lengths to the goal without objects, or its floor alone.
void PlanningCall::make_table(bool whole) {
  const Index headings = whole ? CostToGoMaker::kHeadings : 8;
  table_.emplace(scene_.footprint(), scene_.walls(), scene_.goal(kInset * size_), size_, radius_,
                 headings);
  while (!table_->done() && (whole || !table_->flooded()) && !stopped()) table_->step();
}

/// Follows the floor of the table downhill.
void PlanningCall::find_coarse_path() {
  if (!table_->useful() || !table_->flooded()) return;
  const CostToGo table = table_->table();
  Index row = table.row_of(world_.robot_pose.y);
  Index column = table.column_of(world_.robot_pose.x);
  while (table.floor(row, column) > 0.0) {
    const Vec2 from = table.cells.centre(row, column);
    double least = table.floor(row, column);
    std::pair<Index, Index> next{row, column};
    for (Index r = std::max(row - 1, Index{0}); r <= std::min(row + 1, table.rows() - 1); ++r) {
      for (Index c = std::max(column - 1, Index{0}); c <= std::min(column + 1, table.columns() - 1);
           ++c) {
        if (table.floor(r, c) >= least) continue;
        least = table.floor(r, c);
        next = {r, c};
      }
    }
    if (next == std::pair(row, column)) return;
    std::tie(row, column) = next;
    const Vec2 to = table.cells.centre(row, column);
    coarse_path_.push_back({to.x, to.y, std::atan2(to.y - from.y, to.x - from.x)});
  }
}

/// A pose that a tree grows towards: mostly near the coarse path, sometimes anywhere.
Pose PlanningCall::next_target() {
  const Box& bounds = world_.bounds;
  if (uniform() < near_fraction_) {
    Pose at{world_.goal.point.x, world_.goal.point.y, 2.0 * std::numbers::pi * uniform()};
    if (!coarse_path_.empty()) {
      const auto count = static_cast<double>(coarse_path_.size());
      at = coarse_path_[static_cast<std::size_t>(count * uniform())];
    }
    const double spread = kTargetSpread * size_;
    return {at.x + spread * normal(), at.y + spread * normal(),
            at.theta + kHeadingSpread * normal()};
  }
  return {bounds.x_min + uniform() * (bounds.x_max - bounds.x_min),
          bounds.y_min + uniform() * (bounds.y_max - bounds.y_min),
          2.0 * std::numbers::pi * uniform()};
}

/// The arcs of a random tree to the goal (LaValle and Kuffner 2001); none if it does not get there.
std::vector<Arc> PlanningCall::grow_tree(const ConvexObstacles& among, Index budget) {
  const PathProblem problem = this->problem();
  if (!CollisionChecker(problem.footprint, among).is_free(world_.robot_pose)) return {};
  const double turn_weight = 0.5 * size_;
  Steering steering({1.0 / radius_, kEdge * size_, spacing_, turn_weight}, problem.footprint,
                    among);
  struct Node {
    Pose pose;
    Arc arc;  // that leads to it
    std::size_t before;
  };
  std::vector<Node> tree{{world_.robot_pose, {0.0, 0.0}, 0}};
  for (Index i = 0; i < budget && !(i % 50 == 0 && stopped()); ++i, ++iterations_) {
    const Pose target = next_target();
    const auto distance = [&](const Node& node) {
      return std::hypot(node.pose.x - target.x, node.pose.y - target.y) +
             turn_weight * std::abs(wrap_below_pi(node.pose.theta - target.theta));
    };
    const auto nearest = std::ranges::min_element(tree, {}, distance);
    const double sampled = (2.0 * uniform() - 1.0) / radius_;
    const auto [arc, end] = steering.steer(nearest->pose, target, sampled, 0.0);
    if (arc.length == 0.0) continue;
    tree.push_back({end, arc, static_cast<std::size_t>(nearest - tree.begin())});
    if (!problem.goal.contains({end.x, end.y})) continue;
    std::vector<Arc> arcs;
    for (std::size_t at = tree.size() - 1; at > 0; at = tree[at].before) {
      arcs.push_back(tree[at].arc);
    }
    return {arcs.rbegin(), arcs.rend()};
  }
  return {};
}

/// Paths of two trees, around the objects and among them.
void PlanningCall::grow_two() {
  if (scene_.count() > 0) try_arcs(grow_tree(scene_.everything(), kAvoidIterations), kInfinity);
  try_arcs(grow_tree(scene_.walls(), kTreeIterations), kInfinity);
}

/// One best-first search under the best cost so far, with other edges and masses each time.
void PlanningCall::search_table() {
  if (!table_->useful() || !table_->done()) return;
  const CostToGo table = table_->table();
  const bool first = !search_tree_;
  if (first) {
    const PushTree::CellShape cells{table.rows(), table.columns(), table.headings(), 1};
    search_tree_.emplace(kNodes, scene_.count(), kMemory, cells);
  }
  PushTree& tree = *search_tree_;
  tree.plant(world_.robot_pose, scene_.poses, 0.0);
  const int turns = first ? 2 : 1 + static_cast<int>(3.0 * uniform());  // to each side
  std::vector<double> curvatures;
  for (int i = -turns; i <= turns; ++i) {
    curvatures.push_back(static_cast<double>(i) / static_cast<double>(turns) / radius_);
  }
  std::vector<double> masses = scene_.masses;
  if (!first) {
    for (double& mass : masses) mass *= std::exp(kMassSpread * normal());
  }
  const double length = kArc * table.cells.step * (first ? 1.0 : 0.7 + 0.8 * uniform());
  const double alone = world_.robot.mass * table.length_to_go(world_.robot_pose);
  double inflation = kUnsolvedInflation;
  if (solved()) inflation = std::min(std::max(best_.cost / alone, 1.03), 2.0);
  if (!first) inflation = kInflation + (inflation - kInflation) * uniform();
  const Branching branching{curvatures, length, inflation, kPruning, masses};
  const double bound = (1.0 + kSlack) * best_.cost;
  AStar<PushLattice<QuasiStatic>> search({tree, table, branching, bound, problem(), model_},
                                         2 * kNodes);
  search.start(1);
  while (!stopped()) {
    const Index before = tree.driven;
    if (static_cast<double>(before) >= patience_) {
      patience_ *= kPatienceGrowth;
      return;
    }
    const SearchStatus status = search.run(6 * batch());
    iterations_ += std::max(Index{1}, tree.driven - before);
    if (status == SearchStatus::kFound) {
      try_arcs(tree.arcs_to(search.goal() >> 1), problem().jam_length * world_.robot.mass);
    }
    if (status != SearchStatus::kPaused || tree.full) return;
  }
}

/// Adds arcs to a random tree over poses and costs, which finds what the search cannot represent.
void PlanningCall::grow_at_random(Index arcs) {
  if (!random_tree_) {
    random_tree_.emplace(kRandomNodes, scene_.count(), kMemory, PushTree::CellShape{});
    random_tree_->plant(world_.robot_pose, scene_.poses, 0.0);
  }
  const GrowthScales scales{2.0 * size_, std::numbers::pi, 2.0 * size_ * world_.robot.mass};
  std::vector<GrowthDraw> draws(static_cast<std::size_t>(3 * batch()));
  const Index last = iterations_ + arcs;
  while (iterations_ < last && solved() && !stopped()) {
    for (GrowthDraw& draw : draws) {
      draw = {uniform(), uniform(), uniform(), uniform(), uniform(), uniform()};
    }
    const Growth found =
        grow(*random_tree_, draws, best_.cost, 2.0 * size_, scales, problem(), model_);
    iterations_ += static_cast<Index>(draws.size());
    if (found.status == Growth::Status::kFound) {
      try_arcs(random_tree_->arcs_to(found.node), problem().jam_length * world_.robot.mass);
    } else if (found.status == Growth::Status::kFull) {
      random_tree_->plant(world_.robot_pose, scene_.poses, 0.0);
    }
  }
}

/// Shortcuts the path along some arcs for as long as that pays, and it may still become the best.
void PlanningCall::try_arcs(const std::vector<Arc>& arcs, double limit) {
  Candidate path;
  double capacity = 200.0;  // shortcuts may take more poses
  for (const Arc& arc : arcs) {
    capacity += 3.0 * (std::abs(arc.length) / step_along(arc.curvature, spacing_) + 1.0);
  }
  const bool in_goal = world_.goal.contains({world_.robot_pose.x, world_.robot_pose.y});
  if ((arcs.empty() && !in_goal) || !(capacity < static_cast<double>(kMostPoses))) return;
  const PathProblem problem = this->problem();
  path.resize(static_cast<Index>(capacity), scene_.count());
  path.count = lay_out(world_.robot_pose, arcs, path.view(), problem);
  std::ranges::copy(scene_.poses, path.objects.begin());
  path.cost = 0.0;
  PathSweep<QuasiStatic> sweep(problem, model_);
  for (Index first = 0; first + 1 < path.count; first += batch()) {
    const Index upto = std::min(first + batch() + 1, path.count);
    path.cost = sweep.cost(path.view(), first, upto, limit, std::numeric_limits<Index>::max());
    if (!(path.cost < limit) || (upto < path.count && stopped())) return;
  }
  keep(path);
  while (path.count > 3 && !stopped()) {
    const double before = path.cost;
    shortcut_candidate(path);
    const double gain = before - path.cost;
    const double behind = path.cost - best_.cost;
    if (gain <= kLeastGain * before || behind > kHopefulGains * gain) return;
  }
}

void PlanningCall::shortcut_candidate(Candidate& path) {
  const PathProblem problem = this->problem();
  Candidate trial;
  trial.resize(static_cast<Index>(path.poses.size()), scene_.count());
  std::vector<ShortcutDraw> draws(static_cast<std::size_t>(batch()));
  std::vector<ShortcutShift> shifts(draws.size());
  for (Index done = 0; done < kShortcuts && !stopped(); done += batch()) {
    for (ShortcutDraw& draw : draws) draw = {uniform(), uniform(), uniform(), uniform()};
    for (ShortcutShift& shift : shifts) shift = {normal(), normal()};
    const PricedPath found = shortcut(path.view(), {path.count, path.cost}, draws, shifts,
                                      trial.view(), problem, model_);
    path.count = found.count;
    path.cost = found.cost;
    iterations_ += batch();
    keep(path);
  }
}

/// Keeps a path that is the best so far, and free of jams.
void PlanningCall::keep(Candidate& path) {
  if (path.cost < best_.cost && path.cost < problem().jam_length * world_.robot.mass) best_ = path;
}

Plan PlanningCall::finish() {
  if (!solved()) return {PlanStatus::kNoPlan, "no plan was found within the budget"};
  const auto count = static_cast<std::size_t>(best_.count);
  Plan found{PlanStatus::kSolved};
  found.poses.assign(best_.poses.begin(), best_.poses.begin() + best_.count);
  found.lengths.assign(best_.lengths.begin(), best_.lengths.begin() + best_.count);
  found.times.resize(count);
  found.speeds.resize(count);
  found.turn_rates.resize(count);
  std::vector<double> chords;
  for (std::size_t i = 1; i < count; ++i) chords.push_back(found.lengths[i] - found.lengths[i - 1]);
  const Robot& robot = world_.robot;
  fill_speed_profile(
      {found.poses, std::span(best_.curvatures).first(count)}, chords,
      {size_, robot.max_speed, 0.0, options_.turn_fraction * robot.max_turn_rate,
       robot.max_acceleration, robot.max_turn_acceleration, robot.drive != Drive::kConstantSpeed,
       world_.robot_twist.v, world_.robot_twist.w},
      {found.times, found.speeds, found.turn_rates});
  for (Index i = 0; i < best_.count * best_.object_count; ++i) {
    found.objects.push_back(
        scene_.given_pose(i % best_.object_count, best_.objects[static_cast<std::size_t>(i)]));
  }
  found.travel_cost = robot.mass * found.lengths.back();
  found.interaction_cost = best_.works[count - 1];
  return found;
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

}  // namespace pushplan
