// The predictive tracker: limits of its commands, its geometry, and that it gets to the path.
#include <algorithm>
#include <array>
#include <cmath>

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

/// A horizon of N turn rates and N speeds, in arrays of its own.
struct OwnedHorizon {
  static constexpr std::size_t kSteps = 8;

  Horizon view() {
    return {limits,
            {limits.max_speed, limits.max_turn_rate},
            columns,
            {kSteps, blocks, {hessian.data(), {2 * kSteps, 2 * kSteps}}, gradient, low, high, x},
            steps,
            solved,
            shifted,
            solution,
            nominal,
            &last,
            sent,
            &counts};
  }

  /// Minimises the program within the bounds of its variables and changes, roughly: descends from
  /// the nominal commands by projected Gauss-Seidel, one change after the other within its bounds.
  void solve() {
    constexpr std::size_t kCount = 2 * kSteps;
    for (std::size_t i = 0; i < kSteps; ++i) {
      x[i] = nominal[i].w / limits.max_turn_rate;
      x[kSteps + i] = nominal[i].v / limits.max_speed;
    }
    for (int round = 0; round < 100; ++round) {
      for (std::size_t i = 0; i < kCount; ++i) {
        double slope = gradient[i];
        for (std::size_t j = 0; j < kCount; ++j) slope += hessian[kCount * i + j] * x[j];
        double least = low[i];
        double most = high[i];
        if (i % kSteps == 0) {
          least = std::max(least, low[kCount + i]);
          most = std::min(most, high[kCount + i]);
        } else {
          least = std::max(least, x[i - 1] + low[kCount + i]);
          most = std::min(most, x[i - 1] + high[kCount + i]);
        }
        x[i] = std::min(std::max(x[i] - slope / hessian[(kCount + 1) * i], least), most);
      }
    }
    for (std::size_t i = 0; i < kSteps; ++i) {
      nominal[i] = {x[kSteps + i] * limits.max_speed, x[i] * limits.max_turn_rate};
    }
  }

  CommandLimits limits{false, 0.0, 1.0, 1.5, 2.0, 6.0, 0.0};
  std::array<Index, 2> columns{1, 0};
  std::array<Index, 2> blocks{0, kSteps};
  std::array<double, 4 * kSteps * kSteps> hessian{};
  std::array<double, 2 * kSteps> gradient{};
  std::array<double, 4 * kSteps> low{};
  std::array<double, 4 * kSteps> high{};
  std::array<double, 2 * kSteps> x{};
  std::array<double, kSteps> steps{};
  std::array<double, kSteps> solved{};
  std::array<Index, kSteps> shifted{};
  std::array<Twist, kSteps> solution{};
  std::array<Twist, kSteps> nominal{};
  Twist last{0.0, 0.0};
  std::array<SentCommand, 16> sent{};
  HorizonCounts counts{};
};

/// Commands keep to the limits and accelerations, whatever is wanted; a car's to its radius too.
void commands_keep_to_limits() {
  Xorshift64Star random(3);
  for (const double radius : {0.0, 0.8}) {
    OwnedHorizon owned;
    owned.limits.turning_radius = radius;
    Horizon horizon = owned.view();
    for (int trial = 0; trial < 500; ++trial) {
      const Twist before = owned.last;
      const Twist wanted{between(random, -3.0, 3.0), between(random, -5.0, 5.0)};
      const Twist sent = horizon.send(wanted, 0.1, true);
      CHECK(sent.v >= 0.0 && sent.v <= 1.0 && std::abs(sent.w) <= 1.5);
      CHECK(std::abs(sent.v - before.v) <= 0.2 + 1e-12);
      if (radius == 0.0) CHECK(std::abs(sent.w - before.w) <= 0.6 + 1e-12);
      if (radius > 0.0) CHECK(std::abs(sent.w) * radius <= sent.v + 1e-12);
      CHECK(owned.last.v == sent.v && owned.last.w == sent.w);
    }
  }
}

/// Driven in closed loop, with the solver and with none, the robot gets to the path and stops.
void tracking_gets_to_the_path() {
  const Track track(41);
  const Tuning tuning{0.3, 1.0, 1.5, 2.0, true, true, 1.0, 0.1, 0.05, 3.0, 0.2};
  for (const bool solves : {true, false}) {
    OwnedHorizon owned;
    Tracker tracker(owned.view(), tuning, 1.6, 0.0);
    tracker.begin_track();
    Pose pose{0.0, 0.25, 0.0};
    for (int step = 0; step < 120; ++step) {
      const double time = 0.1 * step;
      const Twist before = owned.last;
      const auto known = tracker.begin_step(track.path(), pose, time, 0.1);
      if (!known && solves) owned.solve();
      const Twist sent =
          known ? *known : tracker.finish_step(track.path(), pose, time, 0.1, solves);
      CHECK(sent.v >= 0.0 && sent.v <= 1.0 && std::abs(sent.w) <= 1.5);
      CHECK(std::abs(sent.v - before.v) <= 0.2 + 1e-9 && std::abs(sent.w - before.w) <= 0.6 + 1e-9);
      pose = arc(pose, sent, 0.1).end;
    }
    CHECK(near_to(pose.y, 0.0, 0.02) && near_to(pose.x, 4.0, 0.2));
    CHECK(owned.last.v < 0.05 && (owned.counts.failed > 0) == !solves);
  }
}

}  // namespace
}  // namespace pushplan::mpc

int main() {
  pushplan::mpc::twists_drive_arcs();
  pushplan::mpc::errors_on_a_line_are_coordinates();
  pushplan::mpc::commands_keep_to_limits();
  pushplan::mpc::tracking_gets_to_the_path();
  return pushplan::tests::finish();
}
