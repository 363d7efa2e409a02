#include "pushplan/motion/speed_profile.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pushplan {
namespace {

constexpr double kStraight = 1e-12;  // curvature [1/m] or length [m] that counts as none
constexpr double kRounding = 1e-3;   // way back that is no more than rounding [circumscribed radii]

/// A part of a path that is driven with one speed, or turns on the spot.
struct Step {
  double rate;       // speed [m/s], or turn rate on the spot [rad/s]
  double extent;     // length [m], or angle [rad]
  double curvature;  // [1/m]; 0 on the spot
  bool on_spot;
  double sign = 0.0;  // of the rate

  bool parts_from(const Step& other) const {
    return sign != other.sign || on_spot != other.on_spot;
  }
};

double sign_of(double value) { return static_cast<double>((value > 0.0) - (value < 0.0)); }

double arc_length(double chord, double curvature) {
  const double half = std::min(std::max(0.5 * std::abs(curvature) * chord, 1e-9), 1.0);
  return chord * std::asin(half) / half;
}

/// The rate of a step after one of `rate`; `gain` is acceleration times distance.
double rate_after(double rate, double gain) {
  return 0.5 * (rate + std::sqrt(rate * rate + 4.0 * gain));
}

/// Slows down where a step would change speed or turn rate faster than the robot can. A change
/// between two steps takes half the time of both. Where direction or kind of motion changes, each
/// step takes its half of that.
void ease(std::span<Step> steps, const SpeedLimits& limits) {
  const double turning = limits.max_turn_acceleration;
  if ((std::isinf(limits.max_acceleration) && std::isinf(turning)) || steps.empty()) return;
  // half of the turn acceleration is for changes of speed on an arc, half for changes of curvature
  const auto acceleration = [&](const Step& step) {
    if (step.on_spot) return turning;
    return std::min(limits.max_acceleration,
                    0.5 * turning / std::max(std::abs(step.curvature), kStraight));
  };
  std::vector<double> rates;
  for (const Step& step : steps) rates.push_back(std::abs(step.rate));
  std::vector<double> gains;
  const auto limit = [&](std::size_t i, double rate) { rates[i] = std::min(rates[i], rate); };
  for (std::size_t i = 0; i + 1 < steps.size(); ++i) {
    const Step& before = steps[i];
    const Step& after = steps[i + 1];
    const double between = 0.5 * (after.extent + before.extent);
    const double change = std::max(std::abs(after.curvature - before.curvature), kStraight);
    const double allowed = std::sqrt(0.5 * turning * between / change);
    const bool parted = after.parts_from(before);
    for (const std::size_t j : {i, i + 1}) {
      limit(j, allowed);
      if (parted) limit(j, std::sqrt(0.5 * acceleration(steps[j]) * steps[j].extent));
    }
    gains.push_back(parted ? kInfinity
                           : std::min(acceleration(after), acceleration(before)) * between);
  }
  const double driven = steps[0].on_spot ? limits.driven_turn_rate : limits.driven_speed;
  const double first = std::max(driven * steps[0].sign, 0.0);
  limit(0, rate_after(first, 0.5 * acceleration(steps[0]) * steps[0].extent));
  for (std::size_t i = 0; i < gains.size(); ++i) limit(i + 1, rate_after(rates[i], gains[i]));
  for (std::size_t i = gains.size(); i-- > 0;) limit(i, rate_after(rates[i + 1], gains[i]));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    steps[i].rate = std::copysign(rates[i], steps[i].rate);
  }
}

/// A step of a robot that slides.
struct Slide {
  double length;     // [m]
  double turn;       // [rad]
  double bearing;    // in the frame of the pose that it leads to [rad]
  double curvature;  // turn over length [1/m]
  double rate;       // speed [m/s]
};

/// Slows down where a step would change velocity or turn rate faster than the robot can, which has
/// some speed before the first. Half of the acceleration changes the speed, half the rest.
void ease(std::span<Slide> steps, const SpeedLimits& limits, double driven) {
  const double acceleration = std::sqrt(0.5) * limits.max_acceleration;
  const double turning = 0.5 * limits.max_turn_acceleration;
  if ((std::isinf(acceleration) && std::isinf(turning)) || steps.empty()) return;
  const auto gain = [&](const Slide& step) {
    return std::min(acceleration, turning / std::max(std::abs(step.curvature), kStraight));
  };
  const auto limit = [](Slide& step, double rate) { step.rate = std::min(step.rate, rate); };
  const auto faster = [](const Slide& step, double gained) {
    return std::sqrt(step.rate * step.rate + gained);
  };
  std::vector<double> gains;
  for (std::size_t i = 0; i + 1 < steps.size(); ++i) {
    Slide& before = steps[i];
    Slide& after = steps[i + 1];
    const double between = 0.5 * (after.length + before.length);
    const double swing = std::max(std::abs(wrap_angle(after.bearing - before.bearing)), kStraight);
    const double change = std::max(std::abs(after.curvature - before.curvature), kStraight);
    const double allowed = std::sqrt(std::min(acceleration / swing, turning / change) * between);
    limit(before, allowed);
    limit(after, allowed);
    gains.push_back(2.0 * std::min(gain(after), gain(before)) * between);
  }
  limit(steps[0], std::sqrt(driven * driven + gain(steps[0]) * steps[0].length));
  for (std::size_t i = 0; i < gains.size(); ++i) limit(steps[i + 1], faster(steps[i], gains[i]));
  for (std::size_t i = gains.size(); i-- > 0;) limit(steps[i], faster(steps[i + 1], gains[i]));
}

std::vector<Slide> slides(std::span<const Pose> poses, const SpeedLimits& limits, Vec2 velocity) {
  std::vector<Slide> steps;
  double driven = 0.0;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const double dx = poses[i + 1].x - poses[i].x;
    const double dy = poses[i + 1].y - poses[i].y;
    const double turn = poses[i + 1].theta - poses[i].theta;
    const double length = std::hypot(dx, dy);
    const double within = std::max(length, kStraight);
    double rate = limits.max_speed;
    if (turn != 0.0) rate = std::min(rate, limits.turn_rate * length / std::abs(turn));
    if (i == 0) driven = std::max((dx * velocity.x + dy * velocity.y) / within, 0.0);
    steps.push_back({length, turn, std::atan2(dy, dx) - poses[i + 1].theta, turn / within, rate});
  }
  ease(steps, limits, driven);
  return steps;
}

}  // namespace

void fill_speed_profile(const Path& path, std::span<const double> chords, const SpeedLimits& limits,
                        const SpeedProfile& profile) {
  const std::size_t last = path.poses.size() - 1;
  std::vector<Step> steps;
  bool back = false;
  for (std::size_t i = 0; i <= last; ++i) {  // the last one has no length
    const double curvature = i < last ? path.curvatures[i + 1] : 0.0;
    if (i < last) {
      const Pose& here = path.poses[i];
      const Pose& next = path.poses[i + 1];
      const double ahead =
          (next.x - here.x) * std::cos(here.theta) + (next.y - here.y) * std::sin(here.theta);
      back = limits.min_speed < 0.0 && ahead < -kRounding * limits.size;
    }
    if (std::isinf(curvature)) {
      const double turn = sign_of(curvature) * limits.turn_rate;
      const double angle = std::abs(path.poses[i + 1].theta - path.poses[i].theta);
      steps.push_back({turn, angle, 0.0, true});
      continue;
    }
    double speed = back ? limits.min_speed : limits.max_speed;
    if (limits.can_stop) {
      const double fastest = limits.turn_rate / std::max(std::abs(curvature), kStraight);
      speed = std::min(std::max(speed, -fastest), fastest);
    }
    steps.push_back({speed, i < last ? arc_length(chords[i], curvature) : 0.0, curvature, false});
  }
  for (Step& step : steps) step.sign = sign_of(step.rate);
  if (limits.can_stop) ease(std::span(steps).first(last), limits);
  double time = 0.0;
  for (std::size_t i = 0; i <= last; ++i) {
    const Step& step = steps[i];
    profile.times[i] = time;
    profile.speeds[i] = step.on_spot ? 0.0 : step.rate;
    profile.turn_rates[i] = step.on_spot ? step.rate : step.rate * step.curvature;
    time += step.extent / std::abs(step.rate);
  }
}

void fill_sliding_profile(std::span<const Pose> poses, const SpeedLimits& limits, Vec2 velocity,
                          const SpeedProfile& profile) {
  constexpr double kLeast = 1e-12;  // speed [m/s] or time [s]
  std::vector<Slide> steps = slides(poses, limits, velocity);
  double time = 0.0;
  double jump = 0.0;  // greatest change of the turn rate [rad/s^2]
  double last = 0.0;  // time that the step before takes [s]
  // the last pose keeps the speed of the step that leads there
  steps.push_back({0.0, 0.0, 0.0, 0.0, steps.empty() ? limits.max_speed : steps.back().rate});
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const auto& [length, turn, bearing, curvature, rate] = steps[i];
    const double takes = length > 0.0 ? length / std::max(rate, kLeast)
                                      : std::abs(turn) / limits.turn_rate;
    profile.times[i] = time;
    profile.speeds[i] = rate;
    profile.turn_rates[i] = turn / std::max(takes, kLeast);
    if (i > 0 && i + 1 < steps.size()) {
      const double change = std::abs(profile.turn_rates[i] - profile.turn_rates[i - 1]);
      jump = std::max(jump, 2.0 * change / std::max(takes + last, kLeast));
    }
    time += takes;
    last = takes;
  }
  const double slower = std::sqrt(std::max(1.0, jump / limits.max_turn_acceleration));
  for (double& value : profile.times) value *= slower;
  for (double& value : profile.speeds) value /= slower;
  for (double& value : profile.turn_rates) value /= slower;
}

double turn_acceleration(std::span<const double> turn_rates, std::span<const double> times) {
  double greatest = 0.0;
  for (std::size_t i = 0; i + 2 < times.size(); ++i) {
    const double takes = std::max(0.5 * (times[i + 2] - times[i]), 1e-300);
    greatest = std::max(greatest, std::abs(turn_rates[i + 1] - turn_rates[i]) / takes);
  }
  return greatest;
}

}  // namespace pushplan
