#include "tree_paths.hpp"

#include <algorithm>
#include <cmath>

#include "pushplan/geometry/shortest_path.hpp"
#include "pushplan/motion/coarse_path.hpp"
#include "pushplan/motion/random_tree/path_tree.hpp"

namespace pushplan {
namespace {

constexpr double kNearCoarsePath = 0.8;  // of the targets at first
constexpr double kSpread = 0.5;        // standard deviation of targets about the coarse path [R]
constexpr double kIterations = 400.0;       // of a first tree, twice as many each time that limits
                                            // are relaxed, ...
constexpr double kMostIterations = 1'600.0;  // ... up to so many
constexpr double kBackward = 2.0;      // distance that a car may go back at first [turning radii]
constexpr double kEdges = 30.0;        // along a coarse path up to which a tree gets its budget;
                                       // in proportion more beyond
constexpr double kMostEdges = 1e6;     // times those of such a path that count
constexpr double kLeastTurn = 0.1;     // a turn that brings the heading nearer by less is not worth
                                       // while [rad]
constexpr double kClearance = 1.1;     // of the path whose bearing is turned to [R]

double length_of(std::span<const Vec2> points) {
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    length += std::hypot(points[i].x - points[i - 1].x, points[i].y - points[i - 1].y);
  }
  return length;
}

/// Places at most `spacing` [m] apart on a polyline.
std::vector<Vec2> spread_on(std::span<const Vec2> corners, double spacing) {
  std::vector<Vec2> places{corners[0]};
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Vec2 from = corners[i - 1];
    const Vec2 leg{corners[i].x - from.x, corners[i].y - from.y};
    const double steps = std::max(1.0, std::ceil(std::hypot(leg.x, leg.y) / spacing));
    for (double k = 1.0; k <= steps; k += 1.0) {
      places.push_back({from.x + k / steps * leg.x, from.y + k / steps * leg.y});
    }
  }
  return places;
}

/// The place `ahead` [m] along a polyline, or its end.
Vec2 along(std::span<const Vec2> corners, double ahead) {
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Vec2 leg{corners[i].x - corners[i - 1].x, corners[i].y - corners[i - 1].y};
    const double length = std::hypot(leg.x, leg.y);
    if (length >= ahead && length > 0.0) {
      const double part = ahead / length;
      return {corners[i - 1].x + part * leg.x, corners[i - 1].y + part * leg.y};
    }
    ahead -= length;
  }
  return corners.back();
}

}  // namespace

TreePaths::TreePaths(PathImprover& improver)
    : improver_(improver), session_(improver.session()), fraction_(kNearCoarsePath) {}

void TreePaths::relax() {
  improver_.relax();
  fraction_ = std::ldexp(kNearCoarsePath, -improver_.relaxed());
}

/// The room of the robot without a margin.
Room TreePaths::bare_room() const {
  Room room = improver_.room();
  room.footprint = {session_.scene.wall_parts(), room.footprint.radius};
  return room;
}

/// True if a search for a way out ends without one.
Task<bool> TreePaths::closed(RoomExploration& search) {
  while (!search.run()) co_await session_.pauses.point();
  co_return search.closed();
}

Task<bool> TreePaths::gets_away() {
  RoomExploration search = explore_ahead(improver_.room(), improver_.lead().pose, improver_.size(),
                                         improver_.turning_radius());
  co_return !co_await closed(search);
}

Task<void> TreePaths::look_ahead() {
  if (!robot().can_stop() || !session_.scene.options.uses(Part::kWaysOut)) co_return;
  const bool away = co_await gets_away();
  if (!away) co_await change_start();
}

Task<void> TreePaths::change_start() {
  if (!session_.scene.options.uses(Part::kWaysOut)) co_return;
  const bool turned = !improver_.lead().arcs.empty();
  improver_.begin_with(std::nullopt);
  if (!turned) {
    std::optional<Lead> lead = co_await start_turn(improver_.lead());
    improver_.begin_with(std::move(lead));
  }
  if (!robot().can_stop()) co_return;
  if (robot().curves_back()) {
    backward_ = std::max(2.0 * backward_, kBackward * robot().turning_radius);
  } else if (robot().reverses()) {
    const bool away = co_await gets_away();
    if (!away) {
      std::optional<Lead> lead = co_await drive_to_turn();
      if (lead) improver_.begin_with(std::move(lead));
    }
  }
  if (improver_.relaxed() > 0 || robot().slides()) co_return;
  const double tightest = std::max(robot().least_radius(), kTightest * improver_.size());
  RoomExploration search = explore_around(moves(), bare_room(), improver_.problem().start,
                                          improver_.size(), tightest);
  boxed_in_ = co_await closed(search);
}

/// The bearing of the shortest path around the walls where it is R away [rad]; NaN without one.
Task<double> TreePaths::first_heading(Vec2 from) {
  const double size = improver_.size();
  for (const double clearance : {kClearance * size, session_.scene.inscribed}) {
    ShortestPath search(*improver_.problem().map, clearance, from,
                        regions_of(improver_.goal()));
    while (!search.run()) co_await session_.pauses.point();
    if (search.points().empty()) continue;
    const Vec2 there = along(search.points(), size);
    co_return std::atan2(there.y - search.points()[0].y, there.x - search.points()[0].x);
  }
  co_return std::nan("");
}

/// It goes the shorter way or, where something static blocks that, the longer one; where both are
/// blocked, as far as it gets.
Task<std::optional<Lead>> TreePaths::start_turn(Lead before) {
  if (!robot().turns_on_spot()) co_return std::nullopt;
  const double heading = co_await first_heading({before.pose.x, before.pose.y});
  const double left = wrap_angle(heading - before.pose.theta);
  if (!(std::abs(left) >= kLeastTurn)) co_return std::nullopt;
  const PathProblem problem = improver_.path_problem();
  Pushing& pushing = session_.pushing;
  SpotTurn turn = pushing.turn(problem, before.pose, before.objects, left);
  const double longer = left - std::copysign(2.0 * std::numbers::pi, left);
  SpotTurn other = pushing.turn(problem, before.pose, before.objects, longer);
  if (other.error < turn.error - kLeastTurn) turn = std::move(other);
  if (turn.error > std::abs(left) - kLeastTurn) co_return std::nullopt;
  before.arcs.push_back({std::abs(turn.angle), std::copysign(kInfinity, turn.angle)});
  before.pose.theta += turn.angle;
  before.objects = std::move(turn.objects);
  co_return before;
}

/// The drive to where a robot that may reverse can turn about, and the turn. It moves no object and
/// keeps the margin from walls if it can.
Task<std::optional<Lead>> TreePaths::drive_to_turn() {
  const Room usual = improver_.room();
  const Pose& start = improver_.problem().start;
  const std::vector<Pose>& objects = improver_.problem().objects;
  std::optional<OwnObstacles> among;  // walls, and the objects where they are at first
  if (!objects.empty()) {
    OwnPolygons shapes = copy_of(improver_.problem().map->parts());
    for (std::size_t k = 0; k < objects.size(); ++k) {
      session_.scene.place_parts(k, objects[k], shapes);
    }
    among.emplace(shapes.polygons(), usual.walls.bounds);
  }
  std::vector<Room> rooms;
  for (const bool around : {true, false}) {
    if (around && !among) continue;
    Room room = usual;
    if (around) room.walls = among->view();
    rooms.push_back(room);
    room.footprint = bare_room().footprint;
    rooms.push_back(room);
  }
  for (const Room& room : rooms) {
    RoomExploration search = explore_to_turn(moves(), room, start, improver_.size());
    while (!search.run()) co_await session_.pauses.point();
    if (!search.away()) continue;
    const std::vector<Arc> arcs = search.arcs();
    SweptPath path = improver_.laid_out(start, arcs, 1.0);
    co_await improver_.sweep(path, path.count, kInfinity);
    const auto row = path.objects_at(path.count - 1);
    Lead driven{arcs, path.used().back(), {row.begin(), row.end()}};
    std::optional<Lead> turned = co_await start_turn(driven);
    if (turned) co_return turned;
    co_return driven;
  }
  co_return std::nullopt;
}

Task<std::optional<Candidate>> TreePaths::grow(double push_weight) {
  session_.count(1);
  co_await session_.pauses.point();
  if (!session_.scene.options.uses(Part::kTrees)) co_return std::nullopt;
  ++session_.counts.trees;
  const std::vector<Vec2> coarse = co_await coarse_path(push_weight);
  if (coarse.empty()) co_return std::nullopt;
  const double size = improver_.size();
  const Room room = improver_.room();
  const double edges = length_of(coarse) / (kEdge * size);
  const double tries = std::min(std::ldexp(kIterations, improver_.relaxed()), kMostIterations);
  const auto budget = static_cast<Index>(tries * std::clamp(edges / kEdges, 1.0, kMostEdges));
  const TreeLimits limits{1.0 / improver_.turning_radius(), kEdge * size, room.spacing, 0.5 * size};
  GoalRegion goal = improver_.goal();
  if (improver_.has_pose_goal()) goal.radius = size;  // the end of its path is made anew
  const double fraction = session_.scene.options.uses(Part::kCoarsePath) ? fraction_ : 0.0;
  TreeTargets targets(coarse, fraction, kSpread * size, room.walls.bounds, session_.random);
  PathTree tree(improver_.lead().pose, goal, limits, backward_, room.footprint,
                room.walls);
  bool there = false;
  for (Index i = 0; i < budget && !there && !improver_.over(); ++i) {
    const Pose target = targets.draw();
    there = tree.grow(target, limits.max_curvature * (2.0 * session_.random.uniform() - 1.0));
    session_.count(1);
    co_await session_.pauses.point();
  }
  if (!there) co_return std::nullopt;
  std::vector<Arc> arcs = tree.arcs();
  session_.counts.nodes += static_cast<Index>(arcs.size());
  co_return co_await improver_.candidate(std::move(arcs), kInfinity);
}

/// A path of the robot's centre, or a path around the walls alone where the grid misses a narrow
/// passage; empty where certainly none leads to the goal.
Task<std::vector<Vec2>> TreePaths::coarse_path(double push_weight) {
  const Scene& scene = session_.scene;
  const Problem& problem = improver_.problem();
  OwnPolygons parts;
  std::vector<double> weights;
  for (std::size_t k = 0; k < problem.objects.size(); ++k) {
    scene.place_parts(k, problem.objects[k], parts);
    weights.resize(static_cast<std::size_t>(parts.polygons().count()),
                   push_weight * scene.masses[k] / robot().mass);
  }
  const CoarseRobot disc{scene.inscribed, scene.size};
  const Vec2 start{problem.start.x, problem.start.y};
  CoarsePath search(*problem.map, disc, start, improver_.goal(), parts.polygons(), weights);
  while (!search.run()) co_await session_.pauses.point();
  if (!search.points().empty()) {
    co_return std::vector<Vec2>(search.points().begin(), search.points().end());
  }
  if (exact_.empty()) {
    Reachable reachable(*problem.map, disc, start, problem.goal);
    while (!reachable.run()) co_await session_.pauses.point();
    sealed_ = reachable.is_sealed();
    if (sealed_) co_return std::vector<Vec2>{};
    ShortestPath exact(*problem.map, scene.inscribed, start, regions_of(improver_.goal()));
    while (!exact.run()) co_await session_.pauses.point();
    exact_ = {start};
    if (!exact.points().empty()) exact_ = spread_on(exact.points(), improver_.size());
  }
  co_return exact_;
}

Task<void> TreePaths::search_window() {
  if (improver_.begin()) co_return;
  co_await look_ahead();
  bool found = co_await along_guide(improver_, true);
  if (!found) found = co_await along_guide(improver_);
  while (!found && !improver_.over() && !sealed_ && !boxed_in_) {
    const std::optional<Candidate> candidate = co_await grow(session_.scene.options.push_weight);
    if (candidate) co_return;
    co_await change_start();
    relax();
  }
}

}  // namespace pushplan
