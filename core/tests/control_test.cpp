// The predictive tracker: limits of its commands, its geometry, and that it gets to the path.
#include <algorithm>
#include <cmath>
#include <limits>

#include "allocations.hpp"
#include "check.hpp"
#include "pushplan/control/mpc/tracker.hpp"
#include "pushplan/motion/dubins.hpp"
#include "shapes.hpp"

namespace pushplan::mpc {
namespace {

using namespace tests;

/// The motion of a twist is that of an arc; its derivatives are those by differences.
void twists_drive_arcs() {
  Xorshift64Star random(1);
  constexpr double kDifference = 1e-6;
  for (int trial = 0; trial < 200; ++trial) {
    const Pose from = random_pose(random, 2.0);
    const Twist twist{between(random, 0.1, 1.0), between(random, -2.0, 2.0)};
    const ArcMotion motion = arc(from, twist, 0.3);
    const Pose end = along_arc(from, {0.3 * twist.v, twist.w / twist.v});
    CHECK(near_to(motion.end.x, end.x) && near_to(motion.end.y, end.y));
    CHECK(near_to(motion.end.theta, end.theta));
    const Pose faster = arc(from, {twist.v + kDifference, twist.w}, 0.3).end;
    const Pose turned = arc(from, {twist.v, twist.w + kDifference}, 0.3).end;
    CHECK(near_to(motion.by_speed.x, (faster.x - end.x) / kDifference, 1e-4));
    CHECK(near_to(motion.by_speed.y, (faster.y - end.y) / kDifference, 1e-4));
    CHECK(near_to(motion.by_turn.x, (turned.x - end.x) / kDifference, 1e-4));
    CHECK(near_to(motion.by_turn.y, (turned.y - end.y) / kDifference, 1e-4));
  }
}

struct Track {
  explicit Track(Index count) {
    for (Index i = 0; i < count; ++i) {
      poses.push_back({0.1 * static_cast<double>(i), 0.0, 0.0});
      lengths.push_back(poses.back().x);
      speeds.push_back(0.8);
    }
  }
  ReferencePath path() const { return {poses, lengths, speeds}; }

  std::vector<Pose> poses;
  std::vector<double> lengths;
  std::vector<double> speeds;
};

/// Places and errors on a straight path are coordinates.
void errors_on_a_line_are_coordinates() {
  const Track track(41);
  Xorshift64Star random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const Pose pose{between(random, 0.0, 5.0), between(random, -1.0, 1.0),
                    between(random, -1.0, 1.0)};
    const PathPlace place = locate(track.path(), {pose.x, pose.y}, 0.0, 10.0);
    const PathErrors found = errors(track.path(), pose, place);
    CHECK(near_to(place.along, pose.x) && near_to(found.offset, pose.y));
    CHECK(near_to(found.error, pose.theta) && near_to(found.curvature, 0.0));
  }
}

constexpr SolverSettings kSolver{1e-6, 2000, 1, 4};
constexpr SolverSettings kFailingSolver{1e-6, 1, 1, 4};

/// What a program minimises.
double cost_of(QuadraticProgram& program, std::span<const double> x) {
  double cost = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    cost += program.gradient[i] * x[i];
    for (std::size_t j = 0; j < x.size(); ++j) cost += 0.5 * program.hessian()(i, j) * x[i] * x[j];
  }
  return cost;
}

/// No point within the bounds costs less than the solution; bounds without a point have none.
void programs_are_minimised() {
  constexpr std::size_t kMoves = 5;
  constexpr std::size_t kCount = 2 * kMoves;
  Xorshift64Star random(4);
  QuadraticProgram program(kCount, kMoves, {0, kMoves}, {1e-8, 5000, 1, 1});
  for (int trial = 0; trial < 40; ++trial) {
    for (std::size_t i = 0; i < kCount; ++i) {
      program.gradient[i] = between(random, -3.0, 3.0);
      program.hessian()(i, i) = between(random, 1.0, 4.0);
      for (std::size_t j = 0; j < i; ++j) {
        program.hessian()(i, j) = program.hessian()(j, i) = between(random, -0.1, 0.1);
      }
    }
    std::fill(program.low.begin() + kCount, program.low.end(), -0.3);
    std::fill(program.high.begin() + kCount, program.high.end(), 0.3);
    CHECK(program.solve());
    const double least = cost_of(program, program.x);
    for (int other = 0; other < 50; ++other) {
      std::vector<double> x(kCount);
      for (std::size_t i = 0; i < kCount; ++i) {
        const double before = i % kMoves == 0 ? 0.0 : x[i - 1];
        x[i] = std::clamp(program.x[i] + between(random, -0.1, 0.1), before - 0.3, before + 0.3);
        x[i] = std::clamp(x[i], -1.0, 1.0);
      }
      CHECK(cost_of(program, x) >= least - 1e-5);
    }
    program.low[kCount] = 2.0;
    program.high[kCount] = 3.0;
    CHECK(!program.solve());
  }
}

constexpr CommandLimits kLimits{false, 0.0, 1.0, 1.5, 2.0, 6.0, 0.0};
constexpr Tuning kTuning{0.3, 1.0, 1.5, 2.0, true, true, 1.0, 0.1, 0.05, 3.0, 0.2};

Tracker make_tracker(const SolverSettings& solver, double delay = 0.0) {
  Tracker tracker(kLimits, kTuning, solver, 8, 1.6, delay, {0.0, 0.0});
  tracker.begin_track();
  return tracker;
}

/// Commands keep to the limits and accelerations, whatever is wanted; a car's to its radius too.
void commands_keep_to_limits() {
  Xorshift64Star random(3);
  for (const double radius : {0.0, 0.8}) {
    CommandLimits limits = kLimits;
    limits.turning_radius = radius;
    Horizon horizon(limits, {1, 0}, 8, 8, kSolver, {0.0, 0.0});
    for (int trial = 0; trial < 500; ++trial) {
      const Twist before = horizon.last;
      const Twist wanted{between(random, -3.0, 3.0), between(random, -5.0, 5.0)};
      const Twist sent = horizon.send(wanted, 0.1, true);
      CHECK(sent.v >= 0.0 && sent.v <= 1.0 && std::abs(sent.w) <= 1.5);
      CHECK(std::abs(sent.v - before.v) <= 0.2 + 1e-12);
      if (radius == 0.0) CHECK(std::abs(sent.w - before.w) <= 0.6 + 1e-12);
      if (radius > 0.0) CHECK(std::abs(sent.w) * radius <= sent.v + 1e-12);
      CHECK(horizon.last.v == sent.v && horizon.last.w == sent.w);
    }
  }
}

/// Driven in closed loop, with the solver and with one that gives up at once, the robot gets to the
/// path and stops.
void tracking_gets_to_the_path() {
  const Track track(41);
  for (const bool solves : {true, false}) {
    Tracker tracker = make_tracker(solves ? kSolver : kFailingSolver);
    Pose pose{0.0, 0.25, 0.0};
    for (int step = 0; step < 120; ++step) {
      const Twist before = tracker.horizon().last;
      const Twist sent = tracker.follow(track.path(), pose, 0.1 * step, 0.1);
      CHECK(sent.v >= 0.0 && sent.v <= 1.0 && std::abs(sent.w) <= 1.5);
      CHECK(std::abs(sent.v - before.v) <= 0.2 + 1e-4 && std::abs(sent.w - before.w) <= 0.6 + 1e-4);
      pose = arc(pose, sent, 0.1).end;
    }
    CHECK(near_to(pose.y, 0.0, 0.02) && near_to(pose.x, 4.0, 0.2));
    CHECK(tracker.horizon().last.v < 0.05 && (tracker.horizon().failed > 0) == !solves);
  }
}

/// While the solver fails the last solution is driven on, for the rest of its horizon.
void failures_are_bridged() {
  const Track track(41);
  Tracker tracker = make_tracker(kSolver);
  Pose pose{0.0, 0.1, 0.0};
  for (int step = 0; step < 10; ++step) {
    pose = arc(pose, tracker.follow(track.path(), pose, 0.1 * step, 0.1), 0.1).end;
  }
  Horizon& horizon = tracker.horizon();
  horizon.program = QuadraticProgram(16, 8, {0, 8}, kFailingSolver);
  for (int step = 10; step < 20; ++step) {
    const Twist next = horizon.solution[1];
    const bool bridged = step < 17;  // 7 of 8 steps are left
    const Twist sent = tracker.follow(track.path(), pose, 0.1 * step, 0.1);
    CHECK(horizon.failed == step - 9 && horizon.known == bridged);
    if (step == 10) CHECK(near_to(sent.v, next.v, 0.02) && near_to(sent.w, next.w, 0.1));
    pose = arc(pose, sent, 0.1).end;
  }
  CHECK(near_to(pose.y, 0.0, 0.1));
}

/// A pose that is not finite gives a stop, or the least speed; the next one is followed again.
void lost_poses_give_a_stop() {
  const Track track(41);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const Pose& lost : {Pose{kNaN, 0.0, 0.0}, Pose{0.0, 0.0, kNaN}}) {
    Tracker tracker = make_tracker(kSolver, 0.2);
    for (int step = 0; step < 5; ++step) {
      tracker.follow(track.path(), {0.1 * step, 0.0, 0.0}, 0.1 * step, 0.1);
    }
    for (int step = 5; step < 15; ++step) tracker.follow(track.path(), lost, 0.1 * step, 0.1);
    CHECK(tracker.horizon().last.v == 0.0 && tracker.horizon().last.w == 0.0);
    CHECK(tracker.follow(track.path(), {0.5, 0.0, 0.0}, 1.5, 0.1).v > 0.1);
  }
  CommandLimits limits = kLimits;
  limits.min_speed = 0.4;
  Tracker ship(limits, kTuning, kSolver, 8, 1.6, 0.0, {0.4, 0.0});
  ship.begin_track();
  CHECK(ship.follow(track.path(), {kNaN, kNaN, kNaN}, 0.0, 0.1).v == 0.4);
}

/// A tracker allocates when it is made, and in no command.
void commands_allocate_nothing() {
  CHECK(allocates([] { make_tracker(kSolver); }));
  const Track track(41);
  for (const SolverSettings& solver : {kSolver, kFailingSolver}) {
    Tracker tracker = make_tracker(solver, 0.2);
    Pose pose{0.0, 0.25, 2.0};  // turns first
    for (int step = 0; step < 120; ++step) {
      CHECK(!allocates([&] {
        const Twist sent = tracker.follow(track.path(), pose, 0.1 * step, 0.1);
        pose = arc(pose, sent, 0.1).end;
      }));
    }
  }
}

}  // namespace
}  // namespace pushplan::mpc

int main() {
  pushplan::mpc::twists_drive_arcs();
  pushplan::mpc::errors_on_a_line_are_coordinates();
  pushplan::mpc::programs_are_minimised();
  pushplan::mpc::commands_keep_to_limits();
  pushplan::mpc::tracking_gets_to_the_path();
  pushplan::mpc::failures_are_bridged();
  pushplan::mpc::lost_poses_give_a_stop();
  pushplan::mpc::commands_allocate_nothing();
  return pushplan::tests::finish();
}
