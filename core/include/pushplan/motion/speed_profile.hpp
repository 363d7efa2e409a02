// Speeds and times along a path: full speed, slower where curvature or accelerations ask for it.
#pragma once

#include <span>

#include "pushplan/motion/dubins.hpp"

namespace pushplan {

/// Limits of a robot along a path, and its motion at the start.
struct SpeedLimits {
  double size;                   // circumscribed radius [m]
  double max_speed;              // [m/s]
  double min_speed;              // [m/s], negative if it may reverse
  double turn_rate;              // greatest one that plans use [rad/s]
  double max_acceleration;       // [m/s^2], infinite where speed can jump
  double max_turn_acceleration;  // [rad/s^2]
  bool can_stop;                 // else it always drives at `max_speed`
  double driven_speed;           // at the start [m/s]
  double driven_turn_rate;       // [rad/s]
};

/// Times of the poses [s], and speed [m/s] and turn rate [rad/s] from each pose on; (N,) each.
struct SpeedProfile {
  std::span<double> times;
  std::span<double> speeds;
  std::span<double> turn_rates;
};

/// Writes the profile of a path of N poses, at least one, that are `chords` (N - 1,) apart [m].
/// Steps against the heading are driven back; those of infinite curvature turn on the spot.
void fill_speed_profile(const Path& path, std::span<const double> chords, const SpeedLimits& limits,
                        const SpeedProfile& profile);

/// The same of an omnidirectional robot, which drives straight from pose to pose and turns
/// meanwhile; at first it moves at a velocity in the world frame [m/s]. Where turns on the spot
/// begin too suddenly for it, the whole profile is slower.
void fill_sliding_profile(std::span<const Pose> poses, const SpeedLimits& limits, Vec2 velocity,
                          const SpeedProfile& profile);

/// The greatest change of turn rate between two steps, each of which takes half of it [rad/s^2].
/// `turn_rates` [rad/s] and `times` [s] are those of a profile.
double turn_acceleration(std::span<const double> turn_rates, std::span<const double> times);

}  // namespace pushplan
