#include "pushplan/control/pure_pursuit.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {

mpc::Twist pursue(const mpc::ReferencePath& track, const Pose& pose, double place, double ahead,
                  const mpc::CommandLimits& limits) {
  const auto lengths = track.lengths;
  const auto poses = track.poses;
  const std::size_t last = lengths.size() - 1;
  const double aim = place + ahead;
  std::size_t i = 0;
  while (i < last && lengths[i + 1] <= place) ++i;
  double speed = track.speeds[i];
  while (i + 1 < last && lengths[i + 1] < aim) ++i;
  Vec2 target;
  if (aim >= lengths[last]) {  // continue the last heading beyond the end
    const double over = aim - lengths[last];
    target = {poses[last].x + over * std::cos(poses[last].theta),
              poses[last].y + over * std::sin(poses[last].theta)};
  } else {
    const double fraction = (aim - lengths[i]) / (lengths[i + 1] - lengths[i]);
    target = {poses[i].x + fraction * (poses[i + 1].x - poses[i].x),
              poses[i].y + fraction * (poses[i + 1].y - poses[i].y)};
  }
  const double dx = target.x - pose.x;
  const double dy = target.y - pose.y;
  const double bearing = wrap_angle(std::atan2(dy, dx) - pose.theta);
  if (std::abs(bearing) > limits.turn_from()) {
    const double turn = std::copysign(limits.max_turn_rate, bearing);
    return {limits.constant ? speed : limits.turning_speed(), turn};
  }
  double curvature = 2.0 * std::sin(bearing) / std::max(std::sqrt(dx * dx + dy * dy), 1e-9);
  const double radius = limits.turning_radius;
  if (radius > 0.0) curvature = std::min(std::max(curvature, -1.0 / radius), 1.0 / radius);
  if (!limits.constant && std::abs(curvature) * speed > limits.max_turn_rate) {
    speed = limits.max_turn_rate / std::abs(curvature);
  }
  return {speed, speed * curvature};
}

mpc::Twist PurePursuit::follow(const mpc::ReferencePath& track, const Pose& pose, double held) {
  mpc::Twist wanted{0.0, 0.0};
  if (is_finite(pose) && !track.poses.empty()) {
    const Vec2 here{pose.x, pose.y};
    place_ = std::max(place_, mpc::locate(track, here, place_, place_ + 2.0 * lookahead_).along);
    place_ = std::min(place_, track.length());
    if (limits_.constant || place_ < track.length() - 1e-9) {
      wanted = pursue(track, pose, place_, lookahead_, limits_);
    } else {
      wanted = limits_.at_end(track, pose.theta, held);
    }
  }
  last_ = limits_.nearest(wanted, last_, held, true);
  return last_;
}

}  // namespace pushplan
