#include "pushplan/planners/rearrangement/controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pushplan::rearrangement {
namespace {

constexpr double kMaxError = 1.75;  // heading error beyond which the object has been lost [rad]

}  // namespace

Carrot along_path(Vec2 at, std::span<const Vec2> path, double reached, double ahead) {
  double best = std::numeric_limits<double>::infinity();
  double nearest = reached;
  double arc = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double dx = path[i + 1].x - path[i].x;
    const double dy = path[i + 1].y - path[i].y;
    const double length = std::sqrt(dx * dx + dy * dy);
    if (length > 0.0 && arc + length >= reached && arc <= reached + 3.0 * ahead) {
      double t = ((at.x - path[i].x) * dx + (at.y - path[i].y) * dy) / length;
      t = std::min(std::max(t, std::max(0.0, reached - arc)), length);
      const double gx = path[i].x + t / length * dx - at.x;
      const double gy = path[i].y + t / length * dy - at.y;
      const double away = std::sqrt(gx * gx + gy * gy);
      if (away < best) {
        best = away;
        nearest = arc + t;
      }
    }
    arc += length;
  }
  const double target = nearest + ahead;
  arc = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double dx = path[i + 1].x - path[i].x;
    const double dy = path[i + 1].y - path[i].y;
    const double length = std::sqrt(dx * dx + dy * dy);
    if (length > 0.0 && (arc + length >= target || i + 2 == path.size())) {
      const double t = (target - arc) / length;  // beyond the end the last leg goes on
      return {{path[i].x + t * dx, path[i].y + t * dy}, nearest, best};
    }
    arc += length;
  }
  return {path.back(), nearest, best};
}

bool PushingController::on_bumper(const Pose& robot, const Pose& object) const {
  const double gx = object.x - robot.x;
  const double gy = object.y - robot.y;
  const double c = std::cos(robot.theta);
  const double s = std::sin(robot.theta);
  const double side = c * gy - s * gx;
  const double forward = c * gx + s * gy;
  return std::abs(side) < 0.95 * half_width && forward > 0.5 * front;
}

PushCommand steer_push(const Pose& robot, const Pose& object, std::span<const Vec2> path,
                       double reached, double shift, const PushingController& controller) {
  const Carrot carrot = along_path({object.x, object.y}, path, reached, controller.ahead);
  const double heading = std::atan2(carrot.point.y - object.y, carrot.point.x - object.x);
  const double error = wrap_angle(heading - robot.theta);
  const double gx = object.x - robot.x;
  const double gy = object.y - robot.y;
  const double left = gx * std::sin(heading) - gy * std::cos(heading);
  const bool holds = controller.on_bumper(robot, object) && std::abs(error) < kMaxError;
  const double correction = error - std::atan((left - shift) / controller.size);
  const double wanted = controller.gain * correction * controller.step / controller.size;
  return {controller.step, std::min(std::max(wanted, -controller.turn), controller.turn),
          carrot.reached, holds};
}

}  // namespace pushplan::rearrangement
