#include "pushplan/motion/speed_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pushplan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kStraight = 1e-12;  // curvature that counts as none [1/m]
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

}  // namespace pushplan
