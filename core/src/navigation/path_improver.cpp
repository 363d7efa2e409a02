#include "path_improver.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

constexpr double kSpacing = 0.15;       // distance between the poses of a path [R]
constexpr double kLeastSpacing = 0.02;  // the same where the margin is thin [R]
constexpr double kThinMargin = 0.05;    // below which a post could hide between two poses [R]
constexpr double kLessMargin = 0.4;     // of the margin is kept where plans fail with it
constexpr double kNoMargin = 0.01;      // a margin as small is given up then [R]
constexpr double kNear = 0.5;           // radius of the disc at a goal's pose to which searches lead
                                        // [its tolerance], or where a way into it begins [R]
constexpr double kSlot = 2.5;           // ways at both ends of a straight way without a turn [R]
constexpr double kLongestSlot = 0.4;    // the same of its length at most
constexpr double kBeyond = 1e4;         // times the way around the workspace: no path is as long
constexpr int kMostRelaxed = 6;         // times that limits are relaxed before all begins again
constexpr Index kShortcuts = 400;       // a round
constexpr double kLeastGain = 0.001;    // share of its cost that a path must lose over one
constexpr double kHopefulGains = 5.0;   // such gains in which a path may still become the best
constexpr Index kBatch = 10;            // between two counts; fewer among many objects
constexpr Index kSweepBatch = 20;       // poses, likewise
constexpr std::size_t kSparePoses = 200;
constexpr double kMostPoses = 1e6;      // of a path

Index share(Index batch, std::size_t objects) {
  return std::max<Index>(1, 10 * batch / (10 + static_cast<Index>(objects)));
}

/// A length [m] that no path without a jam comes near.
double endless_length(const Scene& scene) {
  const Box& box = scene.world.map->bounds();
  double load = 0.0;
  for (const double mass : scene.masses) load += mass;
  load *= scene.options.push_weight / scene.robot().mass;
  const auto& prices = scene.world.prices.values;
  if (!prices.empty()) load += *std::ranges::max_element(prices);
  const double around = box.x_max - box.x_min + box.y_max - box.y_min + scene.size;
  return kBeyond * around * (1.0 + load);
}

GoalRegion entered(GoalRegion goal, double inset) {
  if (goal.kind == GoalRegion::Kind::kDisc) {
    goal.radius = std::max(goal.radius - inset, 0.5 * goal.radius);
  } else {
    goal.point = {goal.point.x + inset * goal.normal.x, goal.point.y + inset * goal.normal.y};
  }
  return goal;
}

}  // namespace

PathImprover::PathImprover(Session& session, Problem problem, double radius)
    : session_(session),
      pushing_(&session.pushing),
      problem_(std::move(problem)),
      goal_(problem_.goal),
      lead_(no_lead()),
      first_radius_(radius),
      turning_radius_(radius),
      footprint_(session.scene.wall_parts(), 0.0),
      jam_length_(endless_length(session.scene)) {
  set_goal();
}

/// Sets where searches lead: into the goal, or near the place from which a path ends at its
/// heading, which is the pose itself, or where a straight way into it begins.
void PathImprover::set_goal() {
  path_goal_ = entered(goal_, kInset * size());
  if (!problem_.goal.has_heading()) return;
  const ConvexObstacles walls = problem_.map->walls();
  const auto fitted = fitting(problem_.goal, session_.scene.wall_parts(), size(), walls);
  fits_ = fitted.has_value();
  if (fitted) problem_.goal = *fitted;
  CollisionChecker bare(footprint_.view(), walls);
  EndTurns turns = end_turns();
  turns.reverses = robot().reverses();
  straight_ = run_up(problem_.goal, turns, size(), bare);
  const Pose begin = behind(problem_.goal, straight_);
  const double near = straight_ == 0.0 ? problem_.goal.radius : size();
  goal_ = {GoalRegion::Kind::kDisc, {begin.x, begin.y}, {}, kNear * near};
  path_goal_ = entered(goal_, kInset * size());
  path_goal_.heading = problem_.goal.heading;
  path_goal_.turns = robot().drive == Drive::kDifferential && straight_ == 0.0;
}

EndTurns PathImprover::end_turns() const {
  return {robot().turns_on_spot(), robot().curves_back(), turning_radius_, spacing_};
}

std::optional<PlanStatus> PathImprover::begin() {
  const Polygons parts = session_.scene.wall_parts();
  const ConvexObstacles walls = problem_.map->walls();
  const double wanted = session_.scene.options.margin * size();
  const auto margin = start_margin(parts, walls, wanted, problem_.start);
  if (!margin) return PlanStatus::kStartBlocked;
  const GoalRegion& goal = problem_.goal;
  if (goal.is_outside(walls.bounds) || !fits_) return PlanStatus::kGoalUnreachable;
  set_margin(*margin);
  if (goal.has_heading()) {
    set_margin(start_margin(parts, walls, *margin, behind(goal, 0.0)).value_or(0.0));
  }
  first_margin_ = margin_;
  if (!reached_by(problem_.start)) return std::nullopt;
  const auto here = std::make_shared<SweptPath>(1, problem_.objects);
  here->poses[0] = problem_.start;
  here->count = 1;
  keep(here, 0.0);
  return PlanStatus::kSolved;
}

/// True if a robot at a pose is at the goal of whole paths.
bool PathImprover::reached_by(const Pose& pose) const {
  if (has_pose_goal()) return problem_.goal.reached_by(pose);
  return goal_.distance({pose.x, pose.y}) == 0.0;
}

void PathImprover::relax() {
  if (++relaxed_ > kMostRelaxed) {  // the way may need no more than another tree
    relaxed_ = 0;
    turning_radius_ = first_radius_;
    set_margin(first_margin_);
  }
  if (relaxed_ < 2) return;
  if (relaxed_ >= 4) set_margin(margin_ <= kNoMargin * size() ? 0.0 : kLessMargin * margin_);
  const double radius = robot().turns_on_spot() ? 0.5 * turning_radius_ : robot().least_radius();
  turning_radius_ = std::max(radius, kTightest * size());
}

/// Keeps a margin [m] from walls; with little of it poses lie closer, for what is thin.
void PathImprover::set_margin(double margin) {
  margin_ = margin;
  spacing_ = kSpacing * size();
  if (margin < kThinMargin * size()) {
    spacing_ = std::min(spacing_, std::max(2.0 * margin, kLeastSpacing * size()));
  }
  footprint_ = OwnFootprint(session_.scene.wall_parts(), margin);
}

PathProblem PathImprover::path_problem() const {
  const Connection curves =
      robot().curves_back() ? Connection::kReedsShepp : Connection::kDubins;
  return {robot().mass,
          session_.scene.options.push_weight,
          turning_radius_,
          spacing_,
          jam_length_,
          1.5 * size(),
          path_goal_,
          footprint_.view(),
          problem_.map->walls(),
          robot().slides() ? Connection::kStraight : curves,
          session_.scene.price()};
}

Room PathImprover::room() const {
  return {footprint_.view(), problem_.map->walls(), entered(goal_, kInset * size()), spacing_};
}

SweptPath PathImprover::laid_out(const Pose& start, std::span<const Arc> arcs,
                                 double spare) const {
  double steps = static_cast<double>(arcs.size());
  std::size_t some = 0;  // without those that are too long for any path
  for (; some < arcs.size(); ++some) {
    const auto& [length, curvature] = arcs[some];
    const double more = std::abs(length) / step_along(curvature, spacing_);
    if (!(steps + more < kMostPoses)) break;
    steps += more;
  }
  SweptPath path(static_cast<std::size_t>(spare * steps) + kSparePoses, problem_.objects);
  lay_out(start, arcs.first(some), path, path_problem());
  return path;
}

SweptPath PathImprover::along(const std::vector<Arc>& arcs, double spare) const {
  std::vector<Arc> all = lead_.arcs;
  all.insert(all.end(), arcs.begin(), arcs.end());
  return laid_out(problem_.start, all, spare);
}

std::optional<SweptPath> PathImprover::ended(SweptPath path) const {
  if (!has_pose_goal()) return path;
  CollisionChecker free = checker();
  const auto end = path_end(problem_.goal, path.used(), end_turns(), straight_, free);
  if (!end) return std::nullopt;
  path.append(end->kept, end->poses, end->curvatures);
  return path;
}

Task<double> PathImprover::sweep(SweptPath& path, Index count, double limit, Index known) {
  const PathProblem problem = path_problem();
  const Index batch = share(kSweepBatch, problem_.objects.size());
  double cost = 0.0;
  if (known >= count) {
    cost = pushing_->sweep(path, known - 1, count, limit, problem);
  }
  for (Index first = known; first < count; first += batch) {
    const Index upto = std::min(first + batch, count);
    cost = pushing_->sweep(path, first - 1, upto, limit, problem);
    if (!(cost < limit)) co_return kInfinity;
    co_await session_.pauses.point();
  }
  co_return cost;
}

Index PathImprover::first_blocked(const SweptPath& path, Index known) const {
  CollisionChecker free = checker();
  return known + free.first_blocked(path.used().subspan(static_cast<std::size_t>(known)));
}

Task<std::optional<Candidate>> PathImprover::candidate(std::vector<Arc> arcs, double limit) {
  std::optional<SweptPath> found = ended(along(arcs, 3.0));
  if (!found) co_return std::nullopt;
  const auto path = std::make_shared<SweptPath>(std::move(*found));
  const double cost = co_await sweep(*path, path->count, limit);
  if (!(cost < limit)) co_return std::nullopt;
  keep(path, cost);
  Candidate found_one{path, SweptPath(path->capacity(), problem_.objects), cost};
  co_return found_one;
}

Task<bool> PathImprover::drives(std::vector<Arc> arcs) {
  std::optional<SweptPath> path = ended(along(arcs, 1.0));
  if (!path) co_return false;
  co_return co_await arrives(std::move(*path));
}

/// Keeps a path if it is a plan.
Task<bool> PathImprover::arrives(SweptPath swept) {
  if (!reached_by(swept.used().back()) || first_blocked(swept) < swept.count) co_return false;
  const auto path = std::make_shared<SweptPath>(std::move(swept));
  const double cost = co_await sweep(*path, path->count, jam_cost());
  if (!(cost < jam_cost())) co_return false;
  keep(path, cost);
  co_return true;
}

Task<bool> PathImprover::slides(std::vector<Vec2> places) {
  const Pose& start = problem_.start;
  double turn = 0.0;
  if (has_pose_goal()) {
    places.back() = problem_.goal.point;
    turn = wrap_angle(problem_.goal.heading - start.theta);
  }
  std::vector<Pose> corners{{start.x, start.y, 0.0}};  // and the way to each
  for (const Vec2 p : places) {
    const Pose& last = corners.back();
    corners.push_back({p.x, p.y, last.theta + std::hypot(p.x - last.x, p.y - last.y)});
  }
  const double length = corners.back().theta;
  if (length == 0.0) co_return false;
  const double steps = std::ceil(length / spacing_ + std::abs(turn) / kMaxTurn);
  if (!(steps < kMostPoses)) co_return false;
  for (const double kept : {0.0, std::min(kSlot * size(), kLongestSlot * length)}) {
    std::vector<double> at{kept, length - kept};
    for (double i = 0.0; i <= steps; i += 1.0) at.push_back(length * i / steps);
    for (const Pose& corner : corners) at.push_back(corner.theta);
    std::ranges::sort(at);
    at.erase(std::unique(at.begin(), at.end()), at.end());
    SweptPath path(at.size(), problem_.objects);
    std::size_t leg = 1;
    for (const double way : at) {
      while (leg + 1 < corners.size() && corners[leg].theta < way) ++leg;
      const Pose& a = corners[leg - 1];
      const Pose& b = corners[leg];
      const double part = b.theta > a.theta ? (way - a.theta) / (b.theta - a.theta) : 1.0;
      const double turned = std::clamp((way - kept) / (length - 2.0 * kept), 0.0, 1.0);
      path.poses[static_cast<std::size_t>(path.count++)] = {
          a.x + part * (b.x - a.x), a.y + part * (b.y - a.y), start.theta + turned * turn};
    }
    if (co_await arrives(std::move(path))) co_return true;
  }
  co_return false;
}

Task<void> PathImprover::work_out(Candidate& candidate) {
  double gain = kInfinity;
  while (gain > kLeastGain * candidate.cost && candidate.cost - best_cost_ <= kHopefulGains * gain &&
         !over()) {
    const double before = candidate.cost;
    co_await shortcut(candidate);
    gain = before - candidate.cost;
  }
}

Task<void> PathImprover::work_out_best() {
  const auto used = static_cast<std::size_t>(best_->count);
  const std::size_t room = used + used / 5 + kSparePoses;  // few shortcuts make it longer
  best_ = std::make_shared<SweptPath>(best_->copy(room));
  Candidate candidate{best_, SweptPath(room, problem_.objects), best_cost_};
  co_await work_out(candidate);
}

Task<void> PathImprover::shortcut(Candidate& candidate) {
  Random& random = session_.random;
  const PathProblem problem = path_problem();
  const Index batch = share(kBatch, problem_.objects.size());
  for (Index done = 0; done < kShortcuts && !over(); done += batch) {
    for (Index i = 0; i < batch; ++i) {
      const ShortcutDraw draw{random.uniform(), random.uniform(), random.uniform(),
                              random.uniform()};
      const ShortcutShift shift{random.normal(), random.normal()};
      candidate.cost = pushing_->shortcut(*candidate.path, candidate.cost, draw, shift,
                                          candidate.trial, problem);
      co_await session_.pauses.point();
    }
    keep(candidate.path, candidate.cost);
    session_.count(batch);
    co_await session_.pauses.point();
  }
}

void PathImprover::keep(const std::shared_ptr<SweptPath>& path, double cost) {
  if (cost >= best_cost_) return;
  best_cost_ = cost;
  tight_ = relaxed_ > 1;
  best_ = path;
  session_.pauses.change();
}

}  // namespace pushplan
