#include "pushplan/planners/pushing/push_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace pushplan::pushing {
namespace {

// angle at which another face is taken to be the pushed one [rad]
constexpr double kFaceTurned = std::numbers::pi * 50.0 / 180.0;
constexpr double kPoseJump =
    0.35;  // a pose farther than this from the predicted one replaces it [L]
// greatest move of the box's place, back or ahead, from one call to the next [L]
constexpr double kSearchBack = 0.5;
constexpr double kSearchAhead = 2.0;
// least speed of a push that has not ended, as a fraction of the greatest, or of that at which the
// robot can turn within the distance to the box
constexpr double kLeastSpeed = 0.4;
// periods for which a command must stay clear of static things, or it is driven more slowly
constexpr double kClearPeriods = 4.0;
// greatest offset [half bumpers] and gap [L] that the problem is solved for
constexpr double kMaxOffset = 1.5;
constexpr double kMaxGap = 2.0;
constexpr double kLeastFraction = 0.5;  // of a command, below which other turns are tried
constexpr std::array<double, 3> kTurnsTried{0.1, 0.3, 0.7};  // to both sides [speed / L]

}  // namespace

PushTracker::PushTracker(const mpc::CommandLimits& limits, const PushTuning& tuning,
                         const mpc::SolverSettings& solver, const Twist& before)
    : horizon_(limits, {0, 1}, static_cast<Index>(tuning.groups.size()), tuning.groups.back() + 1,
               solver, before),
      tuning_(tuning),
      assembly_(horizon_.count(), horizon_.program.moves) {}

void PushTracker::begin(std::vector<Face> faces, const Clearance& clearance, double direction) {
  faces_ = std::move(faces);
  clearance_ = clearance;
  face_ = 0;
  along_ = 0.0;
  slowed_ = 1.0;
  horizon_.missed = 0;
  horizon_.known = false;
  take_face(direction);
}

/// Pushes the face that a direction [rad, box frame] meets most squarely. Forgets the state.
void PushTracker::take_face(double direction) {
  double best = -kInfinity;
  const double c = std::cos(direction);
  const double s = std::sin(direction);
  for (std::size_t k = 0; k < faces_.size(); ++k) {
    const FaceScore& face = faces_[k].score;
    const double score = face.x * c + face.y * s + face.bias;
    if (score > best) {
      best = score;
      face_ = k;
    }
  }
  observed_ = false;
}

/// Estimates the state from poses, now and for when a command of now takes effect.
void PushTracker::estimate(const Pose& robot, const Pose& box, double time) {
  PushState seen = pushing::observe(contact(), faces_[face_].normal, robot, box);
  if (std::abs(seen.angle) > kFaceTurned) {
    take_face(robot.theta - box.theta);
    seen = pushing::observe(contact(), faces_[face_].normal, robot, box);
  }
  correct(seen, time);
  guess_ = state_;
  predict(time, time + tuning_.delay);
}

/// Corrects the predicted state by a fixed fraction of what is observed, unless it jumps.
void PushTracker::correct(const PushState& seen, double time) {
  if (observed_ && tuning_.gain < 1.0 && time > seen_at_) {
    guess_ = state_;
    predict(seen_at_, time);
    const double dx = seen.robot.x - guess_.robot.x;
    const double dy = seen.robot.y - guess_.robot.y;
    const double turn = wrap_angle(seen.robot.theta - guess_.robot.theta);
    const double slip = seen.offset - guess_.offset;
    const double tilt = wrap_angle(seen.angle - guess_.angle);
    const double gap = seen.gap - guess_.gap;
    const auto corrected = [&](double guess, double change) {
      return guess + tuning_.gain * change;
    };
    state_ = {{corrected(guess_.robot.x, dx), corrected(guess_.robot.y, dy),
               corrected(guess_.robot.theta, turn)},
              corrected(guess_.offset, slip),
              corrected(guess_.angle, tilt),
              corrected(guess_.gap, gap)};
    const double far =
        std::max(std::max(std::abs(slip), std::abs(gap)), std::sqrt(dx * dx + dy * dy));
    const double turned = std::max(std::abs(turn), std::abs(tilt));
    if (far / contact().reach() >= kPoseJump || turned >= kPoseJump) state_ = seen;
  } else {
    state_ = seen;
  }
  state_.gap = std::max(state_.gap, 0.0);
  observed_ = true;
  seen_at_ = time;
}

/// Moves the guess on from one time to another by what takes effect in between.
void PushTracker::predict(double begin, double end) {
  const auto sent = horizon_.under_way();
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const double until = i + 1 < sent.size() ? sent[i + 1].time : kInfinity;
    const double duration =
        std::min(until + tuning_.delay, end) - std::max(sent[i].time + tuning_.delay, begin);
    if (duration > 1e-12) advance(contact(), guess_, sent[i].twist, duration);
  }
}

Twist PushTracker::follow(const mpc::ReferencePath& track, const Obstacles& obstacles,
                          const Pose& robot, const Pose& box, double time, double held) {
  slowed_ = 1.0;
  if (!is_finite(robot) || !is_finite(box)) {
    horizon_.known = false;
    return stop(time, held);
  }
  estimate(robot, box, time);
  if (!advance_along(track)) return stop(time, held);
  const PushingProblem problem = problem_now(track, held);
  begin_commands(held);
  mpc::QuadraticProgram& program = horizon_.program;
  const bool solved = horizon_.solve(
      [&] { assembly_.assemble(problem, horizon_.nominal, program.hessian(), program.gradient); });
  return drive(obstacles, solved, time, held);
}

/// Moves on to the box's place on the path. False at its end.
bool PushTracker::advance_along(const mpc::ReferencePath& track) {
  const double size = contact().reach();
  const Pose at = box_pose(contact(), guess_);
  const double low = std::max(along_ - kSearchBack * size, 0.0);
  const mpc::PathPlace place = mpc::locate(track, {at.x, at.y}, low, along_ + kSearchAhead * size);
  along_ = std::min(place.along, track.length());
  return place.along < track.length() - 1e-9;
}

/// Lays the steps and the bounds, and puts up the problem from the state in effect.
PushingProblem PushTracker::problem_now(const mpc::ReferencePath& track, double held) {
  PushWeights weights = tuning_.weights;
  weights.length = contact().reach();
  weights.half = contact().half;
  weights.curvature = faces_[face_].curvature;
  const double length = weights.length;
  const double max_speed = weights.max_speed;
  const mpc::CommandLimits& limits = horizon_.limits;
  horizon_.lay_steps(tuning_.reach * length / max_speed, held);
  horizon_.set_bounds(horizon_.steps[0], horizon_.steps[0]);
  // a push goes forwards; where the robot cannot be that fast yet it gets there as it can
  const double reach = limits.max_acceleration / max_speed * horizon_.steps[0];
  const double least = kLeastSpeed * std::min(1.0, limits.max_turn_rate * length / max_speed);
  std::fill_n(horizon_.program.low.begin(), horizon_.program.moves,
              std::min(least, horizon_.last.v / max_speed + reach));
  PushState near = guess_;  // no farther away than the model means anything for
  const double far = kMaxOffset * contact().half;
  near.offset = std::min(std::max(near.offset, -far), far);
  near.gap = std::min(near.gap, kMaxGap * length);
  return {contact(),      track,          weights,        near,          along_,
          horizon_.last,  horizon_.units, horizon_.steps, tuning_.groups};
}

/// Sets the nominal commands to the last solution, moved on, or to full speed straight on.
void PushTracker::begin_commands(double held) {
  if (horizon_.known) {
    shift(held);
  } else {
    std::fill_n(horizon_.nominal.begin(), horizon_.program.moves,
                Twist{tuning_.weights.max_speed, 0.0});
  }
}

/// Sets the nominal commands to the last solution, moved on by the time since.
void PushTracker::shift(double held) {
  horizon_.shift_steps(held);
  const std::span<const Index> groups = tuning_.groups;
  const Index last = static_cast<Index>(groups.size()) - 1;
  for (std::size_t k = 0; k < groups.size(); ++k) {
    if (k != 0 && groups[k] == groups[k - 1]) continue;
    const Index step = std::min(horizon_.shifted[k], last);
    const Index g = groups[static_cast<std::size_t>(step)];
    horizon_.nominal[static_cast<std::size_t>(groups[k])] =
        horizon_.solution[static_cast<std::size_t>(g)];
  }
}

/// The command of the solution, as fast as what is static allows.
Twist PushTracker::drive(const Obstacles& obstacles, bool solved, double time, double held) {
  if (solved) {
    horizon_.missed = 0;
    horizon_.keep_solution();
  } else {
    ++horizon_.failed;
    ++horizon_.missed;
    if (horizon_.missed > horizon_.count()) horizon_.known = false;
  }
  if (!horizon_.known) return stop(time, held);
  Twist twist = horizon_.solution[0];
  const double length = contact().reach();
  const double look =
      std::max(kClearPeriods * held, 2.0 * std::abs(twist.v) / horizon_.limits.max_acceleration);
  const auto free_fraction = [&](const Twist& tried) {
    return clearance_->free_fraction(contact(), faces_[face_].normal, guess_, tried, look,
                                    obstacles);
  };
  double free = free_fraction(twist);
  if (free < kLeastFraction) {
    const double speed = std::max(std::abs(twist.v), std::abs(twist.w) * length);
    for (std::size_t i = 0; i < 2 * kTurnsTried.size(); ++i) {
      const double turn = kTurnsTried[i / 2];
      const Twist aside{twist.v, twist.w + (i % 2 == 0 ? turn : -turn) * speed / length};
      const double other = free_fraction(aside);
      if (other > free + kLeastFraction * turn) {
        free = other;
        twist = aside;
        break;
      }
    }
  }
  slowed_ = free;
  return send({free * twist.v, free * twist.w}, time, held);
}

/// Sends a command within the accelerations, and remembers it.
Twist PushTracker::send(const Twist& wanted, double time, double held) {
  const Twist command = horizon_.send(wanted, held, true);
  // what another command had followed in effect when the state was observed moves it no more
  horizon_.remember(time, std::max(seen_at_ - tuning_.delay, time - 2.0 * tuning_.delay - 1.0));
  return command;
}

}  // namespace pushplan::pushing
