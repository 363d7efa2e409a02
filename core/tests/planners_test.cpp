// Pieces of planners: contact of bumper and box, rollouts, tables and searches of poses.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>

#include "allocations.hpp"
#include "check.hpp"
#include "pushplan/planners/mppi/rollout.hpp"
#include "pushplan/planners/push_aware/cost_to_go.hpp"
#include "pushplan/planners/pushing/push_tracker.hpp"
#include "pushplan/planners/rearrangement/controller.hpp"
#include "pushplan/planners/rearrangement/goal.hpp"
#include "pushplan/planners/rearrangement/pose_search.hpp"
#include "pushplan/planners/ship_lattice/shortcut_proposals.hpp"
#include "pushplan/planners/ship_predictive/ice_cost_to_go.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

/// A box on the middle of a flat bumper goes straight ahead with it; pushes keep no overlap.
void boxes_stay_on_the_bumper() {
  Xorshift64Star random(1);
  const pushing::BoxContact contact{0.3, 0.25, 0.0, 0.2, -0.2, 0.2, 0.12, 0.4};
  pushing::PushState state{{0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
  const pushing::BoxMotion motion = pushing::advance(contact, state, {0.5, 0.0}, 0.4);
  CHECK(motion.mode == pushing::ContactMode::kStick && near_to(motion.normal, 0.5));
  CHECK(near_to(state.robot.x, 0.2) && near_to(state.offset, 0.0) && near_to(state.gap, 0.0));
  CHECK(near_to(pushing::box_pose(contact, state).x, 0.2 + contact.reach()));
  for (int trial = 0; trial < 300; ++trial) {
    pushing::PushState start{random_pose(random, 2.0), between(random, -0.15, 0.15),
                             between(random, -0.3, 0.3), between(random, 0.0, 0.05)};
    const Pose box = pushing::box_pose(contact, start);
    const pushing::PushState seen = pushing::observe(contact, 0.0, start.robot, box);
    CHECK(near_to(seen.offset, start.offset) && near_to(seen.gap, start.gap));
    CHECK(near_to(wrap_angle(seen.angle - start.angle), 0.0));
    const pushing::Twist twist{between(random, 0.1, 0.5), between(random, -0.5, 0.5)};
    pushing::advance(contact, start, twist, 0.2);
    CHECK(start.gap > -1e-3 && std::isfinite(start.offset + start.angle));
  }
}

/// A robot that pushes a box along a straight path, with a wall beside it.
struct Push {
  Push() {
    for (int i = 0; i < 41; ++i) {
      poses.push_back({0.5 + 0.1 * i, 0.0, 0.0});
      lengths.push_back(0.1 * i);
      speeds.push_back(0.5);
    }
    const std::vector<double> radii{0.45, 0.3};
    tracker.begin({{{1.0, 0.0, 0.0}, contact, 0.0, -1.0}},
                  {bodies.polygons(), radii, {0.02, 1e-6}}, 0.0);
  }

  /// The command of a step, without its motion; the robot is lost if it is not `seen`.
  pushing::Twist command(int step, bool seen = true) {
    const Pose robot = seen ? state.robot : Pose{std::nan(""), 0.0, 0.0};
    return tracker.follow({poses, lengths, speeds}, {walls.polygons(), radii_of_walls, walls.boxes},
                          robot, pushing::box_pose(contact, state), 0.2 * step, 0.2);
  }
  void drive(int step) { pushing::advance(contact, state, command(step), 0.2); }

  pushing::BoxContact contact{0.3, 0.25, 0.0, 0.2, -0.2, 0.2, 0.12, 0.4};
  pushing::PushState state{{0.0, 0.0, 0.0}, 0.03, 0.0, 0.0};
  std::vector<Pose> poses;
  std::vector<double> lengths;
  std::vector<double> speeds;
  Shapes bodies{{rectangle(-0.3, -0.3, 0.3, 0.3), rectangle(-0.2, -0.2, 0.2, 0.2)}};
  Shapes walls{{rectangle(0.0, 1.0, 5.0, 1.2)}};
  std::vector<double> radii_of_walls{0.0};
  pushing::PushTracker tracker{
      {false, 0.0, 0.5, 1.0, 1.0, 4.0, 0.0},
      {{0.0, 0.5, 0.0, -1.0, 0.2, 0.02, 4.0, 0.6, 0.1, 0.03, 0.02, 1.0, 0.01, 3.0},
       {0, 1, 2, 3, 3, 4, 4, 5, 5, 5},
       3.0,
       0.0,
       1.0},
      {1e-5, 1000, 1, 4},
      {0.0, 0.0}};
};

/// The box gets along its path and the robot stops; no command allocates.
void pushes_follow_the_path() {
  Push push;
  for (int step = 0; step < 60; ++step) {
    CHECK(!allocates([&] { push.drive(step); }));
    CHECK(std::abs(pushing::box_pose(push.contact, push.state).y) < 0.05);
  }
  CHECK(near_to(push.tracker.along(), 4.0, 1e-6) && push.tracker.horizon().failed == 0);
  CHECK(push.tracker.horizon().last.v == 0.0);
}

/// While the solver fails the last solution is driven on, until it has run out.
void failing_pushes_stop() {
  Push push;
  for (int step = 0; step < 5; ++step) push.drive(step);
  mpc::Horizon& horizon = push.tracker.horizon();
  horizon.program = mpc::QuadraticProgram(12, 6, {0, 6}, {1e-300, 1, 1, 1});
  CHECK(push.command(5).v > 0.2);
  for (int step = 6; step < 30; ++step) push.command(step);
  CHECK(horizon.failed == 25 && horizon.last.v == 0.0);
}

/// A robot or a box without a pose is not pushed on.
void lost_pushes_stop() {
  Push push;
  for (int step = 0; step < 5; ++step) push.drive(step);
  for (int step = 5; step < 10; ++step) push.command(step, false);
  CHECK(push.tracker.horizon().last.v == 0.0 && push.tracker.horizon().last.w == 0.0);
  CHECK(push.command(10).v > 0.1);
}

/// Rollouts keep to the limits, and stop where they are blocked or in the goal.
void rollouts_keep_to_limits() {
  Xorshift64Star random(2);
  constexpr Index kRollouts = 50;
  constexpr Index kSteps = 12;
  const Shapes robot({rectangle(-0.2, -0.2, 0.2, 0.2)});
  const Shapes walls({rectangle(2.0, -3.0, 2.2, 3.0)});
  const ConvexObstacles obstacles{walls.polygons(), walls.boxes, walls.boxes, {-9, -9, 9, 9}};
  const RolloutProblem problem{0.3,
                               3,
                               {0.0, 1.0, 2.0, 0.2, 0.5, 0.0},
                               {robot.polygons(), 0.3},
                               obstacles,
                               {GoalRegion::Kind::kDisc, {0.0, 1.0}, {}, 0.5},
                               true,
                               0.0};
  std::vector<DriveCommand> controls(kRollouts * kSteps);
  for (auto& control : controls) control = {2.0 * random.uniform(), 2.0 * random.uniform() - 1.0};
  std::vector<Pose> paths(kRollouts * (3 * kSteps + 1));
  std::vector<DriveCommand> twists(controls.size());
  std::vector<Index> ends(kRollouts);
  std::vector<RolloutOutcome> outcomes(kRollouts);
  std::array<int, 3> seen{};
  roll_robots({controls.data(), {kRollouts, kSteps}}, {0.0, 0.0, 0.0}, {0.0, 0.0}, problem,
              {{paths.data(), {kRollouts, 3 * kSteps + 1}},
               {twists.data(), {kRollouts, kSteps}},
               ends,
               outcomes,
               {},
               {}});
  CollisionChecker checker(problem.footprint, obstacles);
  for (std::size_t s = 0; s < ends.size(); ++s) {
    double speed = 0.0;
    for (std::size_t h = 0; h < kSteps; ++h) {
      const DriveCommand twist = twists[s * kSteps + h];
      CHECK(twist.linear >= 0.0 && twist.linear <= 1.0 && std::abs(twist.angular) <= 2.0);
      CHECK(std::abs(twist.linear - speed) <= 0.2 + 1e-12);
      speed = twist.linear;
    }
    const std::span path = std::span(paths).subspan(s * (3 * kSteps + 1), 3 * kSteps + 1);
    CHECK(checker.first_blocked(path.first(static_cast<std::size_t>(ends[s] + 1))) == ends[s] + 1);
    const Pose& end = path[static_cast<std::size_t>(ends[s])];
    CHECK(problem.goal.contains({end.x, end.y}) == (outcomes[s] == RolloutOutcome::kReached));
    CHECK((ends[s] == 3 * kSteps) || outcomes[s] != RolloutOutcome::kDriven);
    ++seen[static_cast<std::size_t>(outcomes[s])];
  }
  CHECK(seen[0] > 0 && seen[1] + seen[2] > 0);
}

/// The floor of a table is never shorter than a straight line, nor longer than the detour of a grid,
/// and no length to go is shorter than it.
void tables_measure_lengths() {
  const std::vector<Vec2> corners = tests::rectangle(-0.2, -0.2, 0.2, 0.2);
  const std::vector<Index> offsets{0, 4};
  const std::vector<Index> none{0};
  const ConvexObstacles walls{{{}, none}, {}, {}, {0.0, 0.0, 10.0, 10.0}};
  const GoalRegion goal{GoalRegion::Kind::kDisc, {5.0, 5.0}, {}, 0.1};
  CostToGoMaker maker({{corners, offsets}, 0.3}, walls, goal, 0.3, 0.5);
  while (!maker.done()) maker.step();
  const CostToGo table = maker.table();
  CHECK(maker.useful() && maker.flooded());
  for (Index at = 0; at < table.floor.size(); ++at) {
    const Vec2 centre = table.cells.centre(at / table.columns(), at % table.columns());
    const double straight = std::hypot(centre.x - 5.0, centre.y - 5.0);
    const double floor = table.floor.data()[at];
    if (centre.x > 10.0 || centre.y > 10.0) continue;  // out of the bounds
    CHECK(floor >= straight - 0.1 && floor <= 1.09 * straight + 0.1);
    CHECK(table.length_to_go({centre.x, centre.y, 1.0}) >= straight - 0.2);
  }
}

/// A search by buckets finds the costs that relaxing all moves finds.
void pose_searches_are_exact() {
  using namespace rearrangement;
  constexpr Index kSide = 7;
  constexpr Index kPoses = 16 * kSide * kSide;
  Xorshift64Star random(3);
  for (int trial = 0; trial < 5; ++trial) {
    const auto blocked = std::make_unique<bool[]>(kPoses);
    const auto moves = std::make_unique<bool[]>(2 * kPoses);
    for (Index i = 0; i < kPoses; ++i) blocked[static_cast<std::size_t>(i)] = random.below(5) == 0;
    for (Index i = 0; i < 2 * kPoses; ++i)
      moves[static_cast<std::size_t>(i)] = random.below(9) == 0;
    const std::vector<double> nothing(kPoses, 0.0);
    const PoseGrid grid{
        {0.0, 0.0}, 0.2, {blocked.get(), {16, kSide, kSide}}, {moves.get(), {2, 16, kSide, kSide}}};
    const PoseSearchProblem problem{
        grid, {nothing.data(), {16, kSide, kSide}}, {nothing.data(), {16, kSide, kSide}}, 0.1, 0.1};
    Index start = 0;
    while (grid.blocked.data()[start]) ++start;
    std::vector<double> costs(kPoses);
    std::vector<Index> before(kPoses);
    PoseSearch search(problem, costs, before);
    search.run({std::array{start}, std::array{0.0}}, {});
    std::vector<double> exact(kPoses, kInfinity);
    exact[static_cast<std::size_t>(start)] = 0.0;
    const auto relax = [&](Index a, Index b, double cost) {
      double& there = exact[static_cast<std::size_t>(b)];
      const double new_cost = exact[static_cast<std::size_t>(a)] + cost;
      const bool better = new_cost < there - 1e-12;
      if (better) there = new_cost;
      return better;
    };
    for (bool changed = true; changed;) {
      changed = false;
      for (Index t = 0; t < 16; ++t) {
        const auto heading = static_cast<std::size_t>(t);
        for (Index i = 0; i < kSide; ++i) {
          for (Index j = 0; j < kSide; ++j) {
            if (grid.blocked(t, i, j)) continue;
            const Index node = (t * kSide + i) * kSide + j;
            const Index next = (t + 1) % 16;
            const Index turned = (next * kSide + i) * kSide + j;
            if (!grid.blocked(next, i, j) && !grid.blocked_moves(1, t, i, j)) {
              const double cost = 0.1 * kTurns[heading];
              changed = relax(node, turned, cost) || changed;
              changed = relax(turned, node, cost) || changed;
            }
            const Index row = i + kMoves[heading].y;
            const Index column = j + kMoves[heading].x;
            if (row < 0 || column < 0 || row >= kSide || column >= kSide) continue;
            if (grid.blocked(t, row, column) || grid.blocked_moves(0, t, i, j)) continue;
            const Index ahead = (t * kSide + row) * kSide + column;
            changed = relax(node, ahead, 0.2 * kLengths[heading]) || changed;
            changed = relax(ahead, node, 0.2 * kLengths[heading]) || changed;
          }
        }
      }
    }
    for (std::size_t i = 0; i < exact.size(); ++i) {
      CHECK(costs[i] == exact[i] || near_to(costs[i], exact[i]));
    }
  }
}

/// Objects in a receptacle are done, those across its edge are not; carrots lie ahead.
void goals_and_carrots_are_where_they_are() {
  using namespace rearrangement;
  Shapes boxes;
  for (int k = 0; k < 4; ++k) boxes.add(rectangle(-0.5, -0.5, 0.5, 0.5));
  const auto area = rectangle(0.0, 0.0, 4.0, 4.0);
  const std::array<GoalEdge, 4> edges{
      {{{1.0, 0.0}, 4.0}, {{-1.0, 0.0}, 0.0}, {{0.0, 1.0}, 4.0}, {{0.0, -1.0}, 0.0}}};
  std::vector<Index> first(static_cast<std::size_t>(boxes.polygons().count()) + 1);
  std::iota(first.begin(), first.end(), Index{0});
  GoalTest inside({boxes.polygons(), first}, {area, edges, true, 0.1});
  GoalTest outside({boxes.polygons(), first}, {area, edges, false, 0.1});
  const std::array<Pose, 4> poses{
      {{2.0, 2.0, 0.3}, {3.8, 2.0, 0.0}, {6.0, 2.0, 0.0}, {kRemoved, kRemoved, 0.0}}};
  std::array<bool, 4> done{};
  inside.all_done(poses, done);
  CHECK((done == std::array<bool, 4>{true, false, false, true}));
  outside.all_done(poses, done);
  CHECK((done == std::array<bool, 4>{false, false, true, true}));
  const std::array<Vec2, 3> path{{{0.0, 0.0}, {2.0, 0.0}, {2.0, 2.0}}};
  const Carrot carrot = along_path({1.5, 0.1}, path, 0.0, 1.0);
  CHECK(near_to(carrot.reached, 1.5) && near_to(carrot.distance, 0.1));
  CHECK(near_to(carrot.point.x, 2.0) && near_to(carrot.point.y, 0.5));
  CHECK(near_to(along_path({2.0, 2.0}, path, 4.0, 1.0).point.y, 3.0));
}

/// Without ice the cost to go straight ahead is mass times distance; a floe in the way adds to it.
void ice_adds_to_the_cost_to_go() {
  std::vector<double> table(21 * 11 * 9);
  std::vector<double> field(80 * 40);
  const IceCostToGo costs{{table.data(), {21, 11, 9}},
                          {field.data(), {80, 40}},
                          0.0,
                          0.0,
                          1.0,
                          1.0,
                          0.3,
                          1.0,
                          50.0,
                          2.0,
                          3.0};
  costs.fill_field({{}, {}, {}, 0.5});
  costs.fill_table();
  const Pose ship{5.0, 4.0, 0.5 * std::numbers::pi};
  const double empty = costs.cost_to_go(ship);
  CHECK(costs.goal() == 20.0 && near_to(empty, 50.0 * 16.0, 1e-6));
  CHECK(costs.cost_to_go({5.0, 20.0, ship.theta}) == 0.0);
  const std::array<Pose, 2> floes{{{5.0, 10.0, 0.0}, {5.0, 14.0, 0.0}}};
  costs.fill_field({floes, std::array{2.0, 2.0}, std::array{30.0, 30.0}, 0.5});
  costs.fill_table();
  CHECK(costs.mass_ahead({5.0, 9.0, ship.theta}) > 30.0);
  CHECK(costs.cost_to_go(ship) > empty + 1.0);
}

/// A changed path begins and ends as it did, or on the goal line, within the spacing.
void changes_join_the_path() {
  Xorshift64Star random(4);
  std::vector<Pose> poses;
  std::vector<double> curvatures(60, 0.0);
  for (int i = 0; i < 60; ++i) poses.push_back({0.1 * i, 0.0, 0.0});
  const ChangeProblem problem{{0.5, 0.1, 6.0}, 0.5, 0.3, {{5.9, 0.0}, {1.0, 0.0}}};
  std::vector<Pose> changed(400);
  std::vector<double> turns(400);
  int found = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const ChangeDraw draw{random.uniform(), random.uniform(), random.uniform(), random.uniform()};
    const ChangeShift shift{between(random, -2.0, 2.0), between(random, -2.0, 2.0)};
    const ChangedPath change =
        propose_change({poses, curvatures}, draw, shift, problem, {changed, turns});
    if (change.size == 0) continue;
    ++found;
    CHECK(changed[0] == poses[0]);
    CHECK(near_to(changed[static_cast<std::size_t>(change.size - 1)].x, 5.9, 1e-6));
    for (std::size_t i = 1; i < static_cast<std::size_t>(change.size); ++i) {
      const double dx = changed[i].x - changed[i - 1].x;
      const double dy = changed[i].y - changed[i - 1].y;
      CHECK(std::hypot(dx, dy) <= 0.1 + 1e-9 && std::abs(turns[i]) <= 2.0 + 1e-9);
    }
  }
  CHECK(found > 50);
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::boxes_stay_on_the_bumper();
  pushplan::pushes_follow_the_path();
  pushplan::failing_pushes_stop();
  pushplan::lost_pushes_stop();
  pushplan::rollouts_keep_to_limits();
  pushplan::tables_measure_lengths();
  pushplan::pose_searches_are_exact();
  pushplan::goals_and_carrots_are_where_they_are();
  pushplan::ice_adds_to_the_cost_to_go();
  pushplan::changes_join_the_path();
  return pushplan::tests::finish();
}
