#include "pushplan/control/mpc/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pushplan/control/pure_pursuit.hpp"

namespace pushplan::mpc {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kBack = 0.25;   // greatest move back of the place from one call to the next [R]
constexpr double kWindow = 2.0;  // distance ahead in which the next place is looked for [R]

/// Speed [m/s] that the plan has at a place, and that still allows to stop at its end.
double speed_at(const ReferencePath& track, const PathPlace& place, const Tuning& tuning,
                double dt) {
  double speed = std::min(track.speeds[static_cast<std::size_t>(place.index)], tuning.max_speed);
  if (tuning.stops) {
    const double left = track.length() - place.along;
    if (left <= 1e-9) return 0.0;
    speed = std::min(std::min(speed, left / dt), std::sqrt(2.0 * tuning.max_acceleration * left));
  }
  return speed;
}

/// The lower half of P, and q.
struct Cost {
  ArrayView<double, 2> hessian;
  std::span<double> gradient;

  /// Adds weight/2 (value + row (z - z_nominal))^2.
  void add(std::span<const double> row, double value, std::span<const Twist> nominal,
           const Tuning& tuning, double weight) const {
    const std::size_t count = nominal.size();
    // later inputs have no influence, and may not be known yet
    for (std::size_t j = 0; j < row.size(); ++j) {
      if (row[j] == 0.0) continue;
      const double input =
          j < count ? nominal[j].w / tuning.max_turn_rate : nominal[j - count].v / tuning.max_speed;
      value -= row[j] * input;
    }
    for (std::size_t j = 0; j < row.size(); ++j) {
      if (row[j] == 0.0) continue;
      const double part = weight * row[j];
      const auto target = hessian.row(static_cast<Index>(j));
      gradient[j] += part * value;
      for (std::size_t i = 0; i <= j; ++i) target[i] += part * row[i];
    }
  }

  /// Adds weight/2 (z_k - wanted)^2.
  void add_diagonal(std::size_t k, double wanted, double weight) const {
    hessian(k, k) += weight;
    gradient[k] -= weight * wanted;
  }
};

}  // namespace

TrackingAssembly::TrackingAssembly(Index variables)
    : jacobian_(static_cast<std::size_t>(variables)),
      offset_slopes_(static_cast<std::size_t>(variables)),
      heading_slopes_(static_cast<std::size_t>(variables)) {}

/// Carries d(x, y, theta)/dz over the step k.
void TrackingAssembly::carry_over(std::size_t k, const ArcMotion& motion, double dt,
                                  std::size_t count, const Tuning& tuning) {
  for (StateSlope& slope : jacobian_) {
    slope.x -= motion.by.y * slope.theta;
    slope.y += motion.by.x * slope.theta;
  }
  jacobian_[k].x += motion.by_turn.x * tuning.max_turn_rate;
  jacobian_[k].y += motion.by_turn.y * tuning.max_turn_rate;
  jacobian_[k].theta += dt * tuning.max_turn_rate;
  if (tuning.optimise_speed) {
    jacobian_[count + k].x += motion.by_speed.x * tuning.max_speed;
    jacobian_[count + k].y += motion.by_speed.y * tuning.max_speed;
  }
}

void TrackingAssembly::assemble(const ReferencePath& track, const Tuning& tuning, const Pose& pose,
                                double along, const Twist& before, std::span<const double> steps,
                                std::span<Twist> nominal, ArrayView<double, 2> hessian,
                                std::span<double> gradient) {
  const std::size_t count = steps.size();
  const std::size_t n = gradient.size();
  const Cost cost{hessian, gradient};
  std::fill_n(hessian.data(), hessian.size(), 0.0);
  std::ranges::fill(gradient, 0.0);
  std::ranges::fill(jacobian_, StateSlope{0.0, 0.0, 0.0});
  Pose here = pose;
  double speed = before.v;
  const double unit = tuning.size / tuning.max_speed;  // T [s]
  const double scale = tuning.max_turn_rate * tuning.size / tuning.max_speed;
  PathPlace place = locate(track, {here.x, here.y}, along, along);
  double curvature = errors(track, here, place).curvature;
  place.along = along;
  for (std::size_t k = 0; k < count; ++k) {
    const double dt = steps[k];
    const double tau = dt / unit;
    const double wanted = speed_at(track, place, tuning, dt);
    if (!(tuning.optimise_speed && std::isfinite(nominal[k].v))) {
      const double reach = tuning.max_acceleration * dt;
      nominal[k].v = std::min(std::max(wanted, speed - reach), speed + reach);
    }
    speed = nominal[k].v;
    const double turning =
        std::min(std::max(speed * curvature, -tuning.max_turn_rate), tuning.max_turn_rate);
    if (!std::isfinite(nominal[k].w)) nominal[k].w = turning;
    const ArcMotion motion = arc(here, {speed, nominal[k].w}, dt);
    carry_over(k, motion, dt, count, tuning);
    here = motion.end;
    place = locate(track, {here.x, here.y}, place.along, place.along + 2.0 * speed * dt);
    const PathErrors found = errors(track, here, place);
    curvature = found.curvature;
    const double c = std::cos(found.heading);
    const double s = std::sin(found.heading);
    const double away = 1.0 - curvature * found.offset;
    for (std::size_t j = 0; j < n; ++j) {
      const StateSlope& slope = jacobian_[j];
      const double ahead = c * slope.x + s * slope.y;
      offset_slopes_[j] = (c * slope.y - s * slope.x) / tuning.size;
      heading_slopes_[j] = slope.theta - curvature * ahead / std::max(away, 0.2);
    }
    const double factor = tau * (k == count - 1 ? tuning.terminal : 1.0);
    cost.add(offset_slopes_, found.offset / tuning.size, nominal, tuning, factor);
    cost.add(heading_slopes_, found.error, nominal, tuning, factor * tuning.heading_weight);
    // departing from what the path asks for, and changing the turn
    cost.add_diagonal(k, turning / tuning.max_turn_rate,
                      tau * tuning.turn_weight * (scale * scale));
    if (tuning.optimise_speed) {
      cost.add_diagonal(count + k, wanted / tuning.max_speed, tau * tuning.speed_weight);
    }
    const double smoothness = tuning.smoothness * (scale * scale) / tau;
    hessian(k, k) += smoothness;
    if (k == 0) {
      gradient[0] -= smoothness * (before.w / tuning.max_turn_rate);
    } else {
      hessian(k - 1, k - 1) += smoothness;
      hessian(k, k - 1) -= smoothness;
    }
  }
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < j; ++i) hessian(i, j) = hessian(j, i);
  }
}

Tracker::Tracker(const CommandLimits& limits, const Tuning& tuning, const SolverSettings& solver,
                 Index steps, double span, double delay, const Twist& before)
    : horizon_(limits, tuning.optimise_speed ? std::vector<Index>{1, 0} : std::vector<Index>{1},
               steps, steps, solver, before),
      tuning_(tuning),
      span_(span),
      delay_(delay),
      assembly_(static_cast<Index>(horizon_.program.x.size())) {}

void Tracker::begin_track() {
  place_ = 0.0;
  horizon_.known = false;
}

Twist Tracker::follow(const ReferencePath& track, const Pose& pose, double time, double held) {
  Twist command;
  if (is_finite(pose) && !track.poses.empty()) {
    command = command_for(track, pose, time, held);
  } else {
    horizon_.known = false;
    command = horizon_.send({0.0, 0.0}, held, true);
  }
  if (delay_ > 0.0) horizon_.remember(time, time - delay_);  // as long as it has no effect yet
  return command;
}

Twist Tracker::command_for(const ReferencePath& track, const Pose& pose, double time, double held) {
  horizon_.lay_steps(span_, held);
  if (horizon_.known) shift(held);
  predict(pose, time);
  const double low = std::max(place_ - kBack * tuning_.size, 0.0);
  const double high = place_ + kWindow * tuning_.size;
  const PathPlace place = locate(track, {pose_.x, pose_.y}, low, high);
  place_ = std::min(place.along, track.length());
  const double error = errors(track, pose_, place).error;
  if (tuning_.stops && place.along >= track.length() - 1e-9) {
    horizon_.known = false;
    return horizon_.send(horizon_.limits.at_end(track, pose_.theta, held), held, true);
  }
  if (std::abs(error) > horizon_.limits.turn_from()) {
    // too far from the path's heading for a linear model: turn towards it first
    horizon_.known = false;
    const double turn = std::copysign(tuning_.max_turn_rate, -error);
    return horizon_.send({horizon_.limits.turning_speed(), turn}, held, true);
  }
  horizon_.set_bounds(horizon_.steps[0], horizon_.steps[1]);
  QuadraticProgram& program = horizon_.program;
  // a plan is driven forwards
  for (std::size_t i = horizon_.steps.size(); i < program.x.size(); ++i) program.low[i] = 0.0;
  if (!horizon_.known) std::ranges::fill(horizon_.nominal, Twist{kNaN, kNaN});
  const bool solved = horizon_.solve([&] {
    assembly_.assemble(track, tuning_, pose_, place_, horizon_.last, horizon_.steps,
                       horizon_.nominal, program.hessian(), program.gradient);
  });
  if (!solved) return fall_back(track, pose, held);
  horizon_.keep_solution();
  horizon_.missed = 0;
  return horizon_.send(horizon_.solution[0], held, false);
}

/// Moves the last solution on by the time that has passed since; NaN past its end.
void Tracker::shift(double held) {
  horizon_.shift_steps(held);
  for (std::size_t k = 0; k < horizon_.steps.size();
       ++k) {  // never from an earlier step to a later
    const Index index = horizon_.shifted[k];
    horizon_.nominal[k] = index < horizon_.count()
                              ? horizon_.solution[static_cast<std::size_t>(index)]
                              : Twist{kNaN, kNaN};
  }
  horizon_.keep_solution();
}

/// Sets where the robot will be when a command of now takes effect.
void Tracker::predict(const Pose& pose, double time) {
  pose_ = pose;
  const auto sent = horizon_.under_way();
  // the command in force t seconds from now is the one that was sent `delay` before that
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const double until = i + 1 < sent.size() ? sent[i + 1].time : time;
    const double lasts = std::min(until, time) - std::max(sent[i].time, time - delay_);
    if (lasts > 0.0) pose_ = arc(pose_, sent[i].twist, lasts).end;
  }
}

/// Drives the last solution, moved on; pure pursuit where it has run out.
Twist Tracker::fall_back(const ReferencePath& track, const Pose& pose, double held) {
  const Twist ahead = horizon_.solution[0];
  ++horizon_.failed;
  ++horizon_.missed;
  const bool known = horizon_.known && std::isfinite(ahead.v) && std::isfinite(ahead.w);
  if (known && horizon_.missed < horizon_.count()) return horizon_.send(ahead, held, true);
  horizon_.known = false;
  return horizon_.send(pursue(track, pose, place_, tuning_.size, horizon_.limits), held, true);
}

}  // namespace pushplan::mpc
