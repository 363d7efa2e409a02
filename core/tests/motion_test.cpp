// Arcs, Dubins paths, collision checks and lattices against what defines them.
#include <algorithm>
#include <array>
#include <cmath>

#include "check.hpp"
#include "pushplan/geometry/convex.hpp"
#include "pushplan/motion/collision.hpp"
#include "pushplan/motion/dubins.hpp"
#include "pushplan/motion/random_tree/steering.hpp"
#include "pushplan/motion/reeds_shepp.hpp"
#include "pushplan/motion/room_ahead.hpp"
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

/// A robot in a closed box gets away by no drive, and through a gap by one that is free.
void rooms_are_left_by_their_gaps() {
  const std::array<Arc, 3> moves{{{0.2, 0.0}, {0.2, 2.0}, {0.2, -2.0}}};
  const Shapes robot({rectangle(-0.2, -0.15, 0.2, 0.15)});
  for (const bool closed : {true, false}) {
    Shapes shapes({rectangle(-1.2, -1.2, 1.2, -1.0), rectangle(-1.2, 1.0, 1.2, 1.2),
                   rectangle(-1.2, -1.0, -1.0, 1.0)});
    if (closed) shapes.add(rectangle(1.0, -1.0, 1.2, 1.0));
    const Walls walls(std::move(shapes));
    const Footprint footprint{robot.polygons(), 0.25};
    const GoalRegion nowhere{GoalRegion::Kind::kDisc, {50.0, 50.0}};
    RoomExploration search({footprint, walls.obstacles(), nowhere, 0.05}, {moves, 2.0, 0.0, true},
                           {-0.5, 0.0, 0.0}, {0.1, 0.2, 25, 32}, 20000);
    const auto outcome = search.run(20000);
    CHECK(outcome ==
          (closed ? RoomExploration::Outcome::kClosed : RoomExploration::Outcome::kAway));
    Pose at{-0.5, 0.0, 0.0};
    CollisionChecker checker(footprint, walls.obstacles());
    for (const Arc& arc : search.arcs()) {
      at = along_arc(at, arc);
      CHECK(checker.is_free(at));
    }
    CHECK(closed ? search.arcs().empty() : at.x > 1.4);
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

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::dubins_paths_end_at_the_goal();
  pushplan::reeds_shepp_curves_end_at_the_goal();
  pushplan::checks_find_every_overlap();
  pushplan::rooms_are_left_by_their_gaps();
  pushplan::primitives_join_lattice_points();
  return pushplan::tests::finish();
}
