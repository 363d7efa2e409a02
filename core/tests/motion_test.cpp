// Arcs, Dubins paths, collision checks and lattices against what defines them.
#include <algorithm>
#include <array>
#include <cmath>

#include "check.hpp"
#include "pushplan/geometry/convex.hpp"
#include "pushplan/motion/coarse_path.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/dubins.hpp"
#include "pushplan/motion/footprint.hpp"
#include "pushplan/motion/goal_approach.hpp"
#include "pushplan/motion/goal_region.hpp"
#include "pushplan/motion/keep_out.hpp"
#include "pushplan/motion/random_tree/path_tree.hpp"
#include "pushplan/motion/length_bound.hpp"
#include "pushplan/motion/random_tree/steering.hpp"
#include "pushplan/motion/reeds_shepp.hpp"
#include "pushplan/motion/room_ahead.hpp"
#include "pushplan/motion/speed_profile.hpp"
#include "pushplan/motion/state_lattice/cost_map.hpp"
#include "pushplan/motion/state_lattice/primitives.hpp"
#include "pushplan/motion/state_lattice/swaths.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

bool same_place(const Pose& a, const Pose& b, double tolerance) {
  return near_to(a.x, b.x, tolerance) && near_to(a.y, b.y, tolerance) &&
         near_to(wrap_angle(a.theta - b.theta), 0.0, tolerance);
}

/// Dubins paths end at the goal, and none is shorter than the straight line or than its reverse.
void dubins_paths_end_at_the_goal() {
  Xorshift64Star random(1);
  constexpr double kRadius = 0.7;
  std::vector<Pose> poses(2000);
  std::vector<double> curvatures(2000);
  for (int trial = 0; trial < 500; ++trial) {
    const Pose start = random_pose(random, 3.0);
    const Pose end = random_pose(random, 3.0);
    const DubinsPath path = dubins(start, end, kRadius);
    Pose at = start;
    double length = 0.0;
    for (const Arc& arc : path.arcs) {
      at = along_arc(at, arc);
      length += arc.length;
      CHECK(arc.length >= 0.0 && std::abs(arc.curvature) <= 1.0 / kRadius + 1e-12);
    }
    CHECK(same_place(at, end, 1e-6) && near_to(length, path.length));
    CHECK(length >= std::hypot(end.x - start.x, end.y - start.y) - 1e-9);
    const Pose back{start.x, start.y, start.theta + std::numbers::pi};
    const Pose from{end.x, end.y, end.theta + std::numbers::pi};
    CHECK(near_to(dubins(from, back, kRadius).length, length, 1e-6));
    const Index count = sample_arcs(start, path.arcs, 0.1, {poses, curvatures});
    CHECK(count > 0 && same_place(poses[static_cast<std::size_t>(count - 1)], end, 1e-6));
    Pose last = start;
    for (Index i = 0; i < count; ++i) {
      const Pose& pose = poses[static_cast<std::size_t>(i)];
      CHECK(std::hypot(pose.x - last.x, pose.y - last.y) <= 0.1 + 1e-9);
      CHECK(std::abs(pose.theta - last.theta) <= kMaxTurn + 1e-9);
      last = pose;
    }
    CHECK(sample_arcs(start, path.arcs, 0.1, PathBuffer{poses, curvatures}.from(1999)) <= 1);
  }
  CHECK(near_to(dubins({0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, kRadius).length, 2.0));
}

/// Curves that may lead back end at the goal, and none is longer than the Dubins path.
void reeds_shepp_curves_end_at_the_goal() {
  Xorshift64Star random(2);
  constexpr double kRadius = 0.7;
  for (int trial = 0; trial < 500; ++trial) {
    const Pose start = random_pose(random, 3.0);
    const Pose end = random_pose(random, 3.0);
    const ShortestCurve curve = reeds_shepp(start, end, kRadius);
    Pose at = start;
    double length = 0.0;
    for (const Arc& arc : curve.arcs) {
      at = along_arc(at, arc);
      length += std::abs(arc.length);
      CHECK(std::abs(arc.curvature) <= 1.0 / kRadius + 1e-12);
    }
    CHECK(same_place(at, end, 1e-6) && near_to(length, curve.length));
    CHECK(length <= dubins(start, end, kRadius).length + 1e-9);
    CHECK(near_to(reeds_shepp(end, start, kRadius).length, length, 1e-6));
  }
}

/// Walls for footprints, in groups as `ConvexObstacles` wants them.
struct Walls {
  explicit Walls(Shapes polygons) : shapes(std::move(polygons)) {
    for (std::size_t i = 0; i < shapes.boxes.size(); ++i) {
      if (i % ConvexObstacles::kGroup == 0) groups.push_back(shapes.boxes[i]);
      const Box& box = shapes.boxes[i];
      Box& group = groups.back();
      group = {std::min(group.x_min, box.x_min), std::min(group.y_min, box.y_min),
               std::max(group.x_max, box.x_max), std::max(group.y_max, box.y_max)};
    }
  }
  ConvexObstacles obstacles() const {
    return {shapes.polygons(), shapes.boxes, groups, {-6.0, -6.0, 6.0, 6.0}};
  }

  Shapes shapes;
  std::vector<Box> groups;
};

Walls random_walls(Xorshift64Star& random, int count) {
  Shapes shapes;
  for (int k = 0; k < count; ++k) {
    const Vec2 centre{between(random, -6.0, 6.0), between(random, -6.0, 6.0)};
    shapes.add(convex_shape(random, centre, 0.8));
  }
  return Walls(std::move(shapes));
}

/// A pose is free where no part overlaps an obstacle; arcs to targets are free and drives too.
void checks_find_every_overlap() {
  Xorshift64Star random(2);
  int free = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const Walls walls = random_walls(random, 20);
    const ConvexObstacles obstacles = walls.obstacles();
    const Shapes robot({rectangle(-0.4, -0.3, 0.5, 0.3), rectangle(0.5, -0.1, 0.8, 0.1)});
    const Footprint footprint{robot.polygons(), radius_of(robot.vertices)};
    CollisionChecker checker(footprint, obstacles);
    Steering steering({1.5, 1.0, 0.05, 0.3}, footprint, obstacles);
    for (int i = 0; i < 50; ++i) {
      const Pose pose = random_pose(random, 6.0);
      bool overlaps = false;
      for (Index part = 0; part < 2; ++part) {
        const auto corners = placed(pose, robot.polygons()[part]);
        for (Index k = 0; k < obstacles.count(); ++k) {
          overlaps = overlaps || convex_overlap(corners, obstacles.polygons[k]);
        }
      }
      CHECK(checker.is_free(pose) == !overlaps);
      CHECK((checker.depth(pose) == 0.0) == !overlaps);
      if (overlaps) continue;
      ++free;
      CHECK(!disc_touches({pose.x, pose.y}, 1e-3, obstacles));
      const SteeredArc steered = steering.steer(pose, random_pose(random, 6.0), 0.5, 0.4);
      CHECK(std::abs(steered.arc.curvature) <= 1.5 + 1e-12);
      CHECK(steered.arc.length <= 1.0 + 1e-12 && steered.arc.length >= -0.4 - 1e-12);
      if (steered.arc.length != 0.0) CHECK(checker.is_free(steered.end));
    }
  }
  CHECK(free > 100 && free < 1400);
}

/// Arcs of a tree that grows through a room with a door; empty if it misses the goal.
std::vector<Arc> tree_arcs(const Pose& root, const GoalRegion& goal, const Footprint& footprint,
                           const ConvexObstacles& walls, std::uint64_t seed) {
  const std::vector<Vec2> coarse{{-3.0, -3.0}, {0.0, 0.0}, {0.5, 0.0}, {3.0, 3.0}};
  Random random(seed);
  TreeTargets targets(coarse, 0.8, 0.3, walls.bounds, random);
  PathTree tree(root, goal, {2.0, 0.8, 0.05, 0.2}, 0.5, footprint, walls);
  for (int i = 0; i < 20'000; ++i) {
    const Pose target = targets.draw();
    if (tree.grow(target, 2.0 * (2.0 * random.uniform() - 1.0))) return tree.arcs();
  }
  CHECK(tree.count() > 1);
  return {};
}

/// A tree finds the door of a room, by arcs that are free and the same from the same seed.
void trees_find_doors() {
  const Walls walls(Shapes({rectangle(-0.1, -6.0, 0.1, -0.6), rectangle(-0.1, 0.6, 0.1, 6.0)}));
  const Shapes robot({rectangle(-0.25, -0.15, 0.25, 0.15)});
  const Footprint footprint{robot.polygons(), 0.3};
  CollisionChecker checker(footprint, walls.obstacles());
  const Pose root{-3.0, -3.0, 4.0};
  const GoalRegion goal{GoalRegion::Kind::kDisc, {3.0, 3.0}, {}, 0.3};
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const std::vector<Arc> arcs = tree_arcs(root, goal, footprint, walls.obstacles(), seed);
    Pose at = root;
    double backward = 0.0;
    for (const Arc& arc : arcs) {
      for (int part = 1; part <= 4; ++part) {
        CHECK(checker.is_free(along_arc(at, {0.25 * part * arc.length, arc.curvature})));
      }
      backward -= std::min(arc.length, 0.0);
      at = along_arc(at, arc);
    }
    CHECK(goal.contains({at.x, at.y}) && backward <= 0.5 + 1e-12);
    const auto same = [](const Arc& a, const Arc& b) {
      return a.length == b.length && a.curvature == b.curvature;
    };
    CHECK(
        std::ranges::equal(arcs, tree_arcs(root, goal, footprint, walls.obstacles(), seed), same));
    const auto others = tree_arcs(root, goal, footprint, walls.obstacles(), seed + 1);
    CHECK(!std::ranges::equal(arcs, others, same));
  }
}

/// Normal deviates have a mean of 0 and a variance of 1, whatever the seed.
void deviates_are_normal() {
  for (const std::uint64_t seed : {0ULL, 1ULL, ~0ULL}) {
    Random random(seed);
    double sum = 0.0;
    double squares = 0.0;
    for (int i = 0; i < 10'000; ++i) {
      const double deviate = random.normal();
      sum += deviate;
      squares += deviate * deviate;
    }
    CHECK(near_to(sum / 1e4, 0.0, 0.04) && near_to(squares / 1e4, 1.0, 0.06));
  }
}

/// A robot in a closed box gets away by no drive, and through a gap by one that is free.
void rooms_are_left_by_their_gaps() {
  const Shapes robot({rectangle(-0.2, -0.15, 0.2, 0.15)});
  const Pose start{-0.2, 0.0, 0.0};
  constexpr double kSize = 0.25;
  for (const bool closed : {true, false}) {
    Shapes shapes({rectangle(-0.7, -0.4, 0.1, -0.2), rectangle(-0.7, 0.2, 0.1, 0.4),
                   rectangle(-0.7, -0.2, -0.5, 0.2)});
    if (closed) shapes.add(rectangle(0.1, -0.2, 0.3, 0.2));
    const Walls walls(std::move(shapes));
    const Footprint footprint{robot.polygons(), kSize};
    const GoalRegion nowhere{GoalRegion::Kind::kDisc, {50.0, 50.0}};
    const Room room{footprint, walls.obstacles(), nowhere, 0.05};
    const auto leads_out = [&](RoomExploration search, Pose at) {
      while (!search.run()) CHECK(!search.away() && !search.closed());
      CHECK(search.closed() == !search.away() && search.closed() == search.arcs().empty());
      CollisionChecker checker(footprint, walls.obstacles());
      for (const Arc& arc : search.arcs()) {
        at = along_arc(at, arc);
        CHECK(checker.is_free(at));
      }
      return search.away();
    };
    CHECK(leads_out(explore_ahead(room, start, kSize, 0.5), start) == !closed);
    CHECK(leads_out(explore_around({true, false}, room, start, kSize, 0.5), start) == !closed);
    CHECK(leads_out(explore_to_turn({true, false}, room, start, kSize), start) == !closed);
    const Pose outside{2.0, 0.0, 0.0};  // it can turn there already
    CHECK(!leads_out(explore_to_turn({true, false}, room, outside, kSize), outside));
  }
}

/// Primitives end on lattice points; swaths hold each newly covered cell once.
void primitives_join_lattice_points() {
  std::vector<LatticeConnection> found(500);
  const double heading = std::atan2(1.0, 2.0);
  const Index count = find_connections(0.0, heading, {3.0, 6, 0.1}, found);
  CHECK(count > 0 && count < 500);
  const Shapes robot({rectangle(-2.2, -1.2, 2.2, 1.2)});
  for (Index i = 0; i < count; ++i) {
    const LatticeConnection& connection = found[static_cast<std::size_t>(i)];
    Pose at{0.0, 0.0, 0.0};
    for (const Arc& arc : connection.arcs) at = along_arc(at, arc);
    CHECK(same_place(at, {connection.end.x, connection.end.y, heading}, 1e-6));
    CHECK(near_to(connection.end.x, std::rint(connection.end.x)));
    std::vector<std::pair<Index, Index>> cells;
    for (const ColumnRun& run : sweep_cells(0.0, connection.arcs, robot.polygons(), 2.6, 0.1)) {
      CHECK(run.first_row < run.end_row);
      for (Index row = run.first_row; row < run.end_row; ++row) cells.emplace_back(run.column, row);
    }
    std::sort(cells.begin(), cells.end());
    CHECK(!cells.empty() && std::adjacent_find(cells.begin(), cells.end()) == cells.end());
  }
  const std::array<double, 6> grid{1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  std::array<double, 9> sums{};
  prefix_sums({grid.data(), {2, 3}}, {sums.data(), {3, 3}});
  CHECK((sums == std::array<double, 9>{0.0, 1.0, 5.0, 0.0, 2.0, 7.0, 0.0, 3.0, 9.0}));
}

std::vector<Vec2> ngon(Vec2 middle, double radius, int corners) {
  std::vector<Vec2> made;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / corners;
    made.push_back({middle.x + radius * std::cos(angle), middle.y + radius * std::sin(angle)});
  }
  return made;
}

/// Coarse paths go around walls and what is expensive, in pieces; two searches share what they make
/// of a map.
void coarse_paths_trade_length_against_weights() {
  OwnPolygons pillar;
  pillar.add(ngon({10.0, 10.0}, 3.0, 900));
  const Box bounds{0.0, 0.0, 20.0, 20.0};
  const StaticMap map(pillar, {}, bounds);
  const CoarseRobot robot{0.1, 0.15};
  const GoalRegion goal{GoalRegion::Kind::kDisc, {16.0, 10.0}, {0.0, 0.0}, 0.01};
  OwnPolygons boxes;
  boxes.add(rectangle(8.0, 13.0, 12.0, 20.0));  // above the pillar
  const std::array weights{1e4};
  CoarsePath path(map, robot, {4.0, 10.2}, goal, boxes.polygons(), weights);
  int pieces = 1;
  while (!path.run()) ++pieces;
  CHECK(pieces > 20 && path.run());
  double highest = 0.0;
  double gap = 9.0;
  for (const Vec2 p : path.points()) {
    highest = std::max(highest, p.y);
    gap = std::min(gap, core_distance(p, map.parts()[0]));
  }
  CHECK(highest < 10.5 && gap >= 0.1);
  CHECK(std::hypot(path.points().back().x - 16.0, path.points().back().y - 10.0) < 0.1);

  const StaticMap shared(pillar, {}, bounds);
  CoarsePath one(shared, robot, {4.0, 10.2}, goal, boxes.polygons(), weights);
  CoarsePath other(shared, robot, {4.0, 10.2}, goal, boxes.polygons(), weights);
  int halves = 1;
  while (!(one.run() & other.run())) ++halves;
  CHECK(halves < pieces);
  for (const CoarsePath* again : {&one, &other}) {
    CHECK(again->points().size() == path.points().size());
    for (std::size_t i = 0; i < path.points().size(); ++i) {
      CHECK(again->points()[i].x == path.points()[i].x);
      CHECK(again->points()[i].y == path.points()[i].y);
    }
  }
}

/// Only a closed wall seals a goal off, and only where cells are fine enough to tell.
void sealed_goals_are_known() {
  const GoalRegion goal{GoalRegion::Kind::kLine, {8.0, 0.0}, {1.0, 0.0}};
  for (const double door : {0.0, 1.0}) {
    const StaticMap map({}, {{{{5.0, 0.0}, {5.0, 10.0 - door}}, 0.1}}, {0.0, 0.0, 10.0, 10.0});
    for (const double inscribed : {0.01, 0.3}) {
      Reachable search(map, {inscribed, 0.4}, {2.0, 2.0}, goal);
      while (!search.run()) continue;
      CHECK(search.is_sealed() == (door == 0.0 && inscribed == 0.3));
    }
  }
}

/// Where the robot does not fit at a goal, tolerances are found around where it does.
void goals_move_to_where_the_robot_fits() {
  OwnPolygons footprint;
  footprint.add(rectangle(-0.2, -0.2, 0.2, 0.2));
  OwnPolygons post;
  post.add(rectangle(5.1, 4.0, 6.0, 6.0));
  const StaticMap map(post, {}, {0.0, 0.0, 10.0, 10.0});
  GoalRegion goal{GoalRegion::Kind::kDisc, {5.0, 5.0}, {0.0, 0.0}, 0.4, 0.0};
  const double size = 0.2 * std::numbers::sqrt2;
  CollisionChecker checker({footprint.polygons(), size}, map.walls());
  const auto moved = fitting(goal, footprint.polygons(), size, map.walls());
  CHECK(moved && moved->point.x < 5.0 && moved->radius < 0.4);
  CHECK(moved && checker.is_free({moved->point.x, moved->point.y, moved->heading}));
  goal.radius = 0.05;
  CHECK(!fitting(goal, footprint.polygons(), size, map.walls()));
  goal.point.x = 4.0;
  const auto same = fitting(goal, footprint.polygons(), size, map.walls());
  CHECK(same && same->point.x == 4.0 && same->radius == 0.05);
}

/// What a robot keeps away from leaves it free; far away it is grown by the whole margin.
void margins_leave_the_robot_free() {
  Xorshift64Star random(6);
  const Box bounds{-5.0, -5.0, 5.0, 5.0};
  const Shapes robot({rectangle(-0.3, -0.2, 0.3, 0.2)});
  const double size = radius_of(robot.vertices);
  for (int trial = 0; trial < 100; ++trial) {
    OwnPolygons polygons;
    polygons.add(convex_shape(random, {between(random, -2.0, 2.0), 1.0}, 0.8));
    polygons.add(rectangle(3.0, 3.0, 4.0, 4.0));
    const std::vector<Wall> lines{{{{-2.0, -1.0}, {2.0, -1.0}}, 0.1}};
    const auto map = std::make_shared<const StaticMap>(polygons, lines, bounds);
    const Pose pose{between(random, -2.0, 2.0), between(random, -0.8, 0.8), 0.0};
    const auto kept = keep_out(map, robot.polygons(), size, pose, 0.3);
    CHECK(keep_out(map, robot.polygons(), size, pose, 0.3) == kept);
    CHECK(keep_out(map, robot.polygons(), size, pose, 0.0) == map);
    CHECK(near_to(kept->polygons()[1][0].x, 2.7));
    const OwnFootprint bare(robot.polygons(), 0.0);
    const bool free = CollisionChecker(bare.view(), map->walls()).is_free(pose);
    CHECK(CollisionChecker(bare.view(), kept->walls()).is_free(pose) == free);
    const auto margin = start_margin(robot.polygons(), map->walls(), 0.3, pose);
    CHECK(margin.has_value() == free);
    if (!free) continue;
    const OwnFootprint grown(robot.polygons(), *margin);
    CHECK(CollisionChecker(grown.view(), map->walls()).is_free(pose));
    CHECK(near_to(grown.view().radius, std::hypot(0.3 + *margin, 0.2 + *margin)));
  }
  const GoalRegion goal{GoalRegion::Kind::kDisc, {6.0, 0.0}, {}, 0.9};
  CHECK(goal.is_outside(bounds) && !goal.is_outside({-5.0, -5.0, 5.2, 5.0}));
}

/// A robot that slides keeps its speed and its accelerations.
void slides_keep_the_limits() {
  Xorshift64Star random(7);
  const SpeedLimits limits{0.5, 0.8, -0.8, 1.5, 0.6, 1.2, true, 0.0, 0.0};
  std::vector<Pose> poses{{0.0, 0.0, 0.0}};
  for (int i = 0; i < 50; ++i) {
    const Pose step = random_pose(random, 0.2);
    const Pose& last = poses.back();
    poses.push_back({last.x + step.x, last.y + step.y, last.theta + 0.05 * step.theta});
  }
  std::vector<double> times(poses.size());
  std::vector<double> speeds(poses.size());
  std::vector<double> turn_rates(poses.size());
  fill_sliding_profile(poses, limits, {0.0, 0.0}, {times, speeds, turn_rates});
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const double length = std::hypot(poses[i + 1].x - poses[i].x, poses[i + 1].y - poses[i].y);
    const double takes = times[i + 1] - times[i];
    CHECK(near_to(length, speeds[i] * takes) && speeds[i] <= 0.8);
    CHECK(near_to(poses[i + 1].theta - poses[i].theta, turn_rates[i] * takes));
  }
  CHECK(turn_acceleration(turn_rates, times) <= 1.2 + 1e-9 && turn_rates.back() == 0.0);
  const std::array<double, 3> rates{1.0, 0.0, 0.0};
  CHECK(turn_acceleration(rates, std::array<double, 3>{0.0, 1.0, 4.0}) == 0.5);
}

/// The bound is known to the straight line at first, then to the way around a wall.
void bounds_know_walls_and_turns() {
  OwnPolygons blocks;
  blocks.add(rectangle(2.0, -3.0, 3.0, 3.0));
  const StaticMap map(blocks, {}, {-1.0, -9.0, 9.0, 9.0});
  const GoalRegion goal{GoalRegion::Kind::kDisc, {5.0, 0.0}, {}, 1.0};
  const Pose start{0.0, 0.0, std::numbers::pi};
  LengthBound bound(map, start, goal, 2.0, 0.1, 0.0);
  CHECK(near_to(bound.cost(), 2.0 * 4.0));
  while (!bound.run()) {
  }
  CHECK(bound.cost() > 2.0 * 7.0 && bound.cost() < 2.0 * 8.0);
  const LengthBound turned(map, start, goal, 2.0, 0.1, 1.0);
  CHECK(turned.cost() > 2.0 * (4.0 + 0.9 * std::numbers::pi));
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::coarse_paths_trade_length_against_weights();
  pushplan::sealed_goals_are_known();
  pushplan::goals_move_to_where_the_robot_fits();
  pushplan::dubins_paths_end_at_the_goal();
  pushplan::reeds_shepp_curves_end_at_the_goal();
  pushplan::checks_find_every_overlap();
  pushplan::trees_find_doors();
  pushplan::deviates_are_normal();
  pushplan::rooms_are_left_by_their_gaps();
  pushplan::primitives_join_lattice_points();
  pushplan::margins_leave_the_robot_free();
  pushplan::slides_keep_the_limits();
  pushplan::bounds_know_walls_and_turns();
  return pushplan::tests::finish();
}
