#include "pushplan/planners/pushing/box_motion.hpp"

namespace pushplan::pushing {
namespace {

constexpr double kSubstep = 0.2;  // greatest motion of the bumper in one substep [distance from the
                                  // axle to the box's centre]
constexpr double kMaxSubsteps = 6.0;
constexpr double kFlush = 1e-9;  // angle below which a box counts as lying on the bumper [rad]

/// Moves the robot along an arc and leaves the box where it is on the ground.
void drive(Pose& robot, const Twist& twist, double dt) {
  const double theta = robot.theta;
  const double turn = twist.w * dt;
  const double half = 0.5 * turn;
  const double chord = twist.v * dt * (std::abs(half) > 1e-9 ? std::sin(half) / half : 1.0);
  robot.x += chord * std::cos(theta + half);
  robot.y += chord * std::sin(theta + half);
  robot.theta = theta + turn;
}

/// The box in the robot's frame.
struct Left {
  double offset;
  double angle;
  double gap;
};

/// The box when the robot has moved for `dt` and the box, at x `ahead`, stood.
Left leave(const BoxContact& contact, const PushState& state, double ahead, const Twist& twist,
           double dt) {
  const double turn = twist.w * dt;
  const double half = 0.5 * turn;
  const double ch = std::cos(half);
  const double sh = std::sin(half);
  const double chord = twist.v * dt * (std::abs(half) > 1e-9 ? sh / half : 1.0);
  const double dx = ahead - chord * ch;
  const double dy = state.offset - chord * sh;
  const double c = ch * ch - sh * sh;
  const double s = 2.0 * ch * sh;
  const double offset = c * dy - s * dx;
  const double angle = state.angle - turn;
  return {offset, angle, c * dx + s * dy - contact.standoff(offset, angle).x};
}

/// One substep of a box that touches the bumper at an angle of known cosine and sine.
BoxMotion push(const BoxContact& contact, PushState& state, double c, double s, const Twist& twist,
               double dt) {
  const auto [motion, x] = contact_velocity(contact, state.offset, state.angle, c, s, twist, dt);
  const double uy = twist.w * x;
  const double before = state.angle - contact.flush_angle(state.offset);
  state.offset += dt * (motion.normal * s + motion.sideways * c - uy);
  state.angle += dt * (motion.turn - twist.w);
  if (contact.curvature >= 0.0 && std::abs(before) > kFlush) {
    const double flush = contact.flush_angle(state.offset);
    // the other end touches before the step is over
    if (before * (state.angle - flush) < 0.0) state.angle = flush;
  }
  return motion;
}

}  // namespace

BoxMotion advance_box(const BoxContact& contact, PushState& state, const Twist& twist, double dt) {
  const double reach = contact.reach();
  const double travel = std::abs(twist.v) * dt + std::abs(twist.w) * dt * reach;
  const double count =
      std::max(1.0, std::min(kMaxSubsteps, std::ceil(travel / (kSubstep * reach))));
  const double step = dt / count;
  BoxMotion motion;
  for (Index i = 0; i < static_cast<Index>(count); ++i) {
    const double gap = std::max(state.gap, 0.0);
    double c = std::cos(state.angle);
    double s = std::sin(state.angle);
    const double ahead = contact.standoff(state.offset, c, s).x + gap;
    const Left left = leave(contact, state, ahead, twist, step);
    if (left.gap >= 1e-9) {
      state.offset = left.offset;
      state.angle = left.angle;
      state.gap = left.gap;
      motion = {};
      continue;
    }
    const double fraction = gap > 1e-9 && gap > left.gap ? gap / (gap - left.gap) : 0.0;
    if (fraction > 0.0) {
      const Left met = leave(contact, state, ahead, twist, fraction * step);
      state.offset = met.offset;
      state.angle = met.angle;
      c = std::cos(state.angle);
      s = std::sin(state.angle);
    }
    state.gap = 0.0;
    if (fraction < 1.0) motion = push(contact, state, c, s, twist, (1.0 - fraction) * step);
  }
  return motion;
}

BoxMotion advance(const BoxContact& contact, PushState& state, const Twist& twist, double dt) {
  const BoxMotion motion = advance_box(contact, state, twist, dt);
  drive(state.robot, twist, dt);  // one arc, whatever the box does
  return motion;
}

void roll_out(const BoxContact& contact, const PushState& start, std::span<const Twist> twists,
              std::span<const double> steps, std::span<PushState> states,
              std::span<BoxMotion> motions) {
  states[0] = start;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    states[k + 1] = states[k];
    motions[k] = advance(contact, states[k + 1], twists[k], steps[k]);
  }
}

PushState observe(const BoxContact& contact, double normal, const Pose& robot, const Pose& box) {
  const double dx = box.x - robot.x;
  const double dy = box.y - robot.y;
  const double c = std::cos(robot.theta);
  const double s = std::sin(robot.theta);
  const double offset = c * dy - s * dx;
  const double angle = wrap_angle(box.theta + normal - robot.theta);
  return {robot, offset, angle, c * dx + s * dy - contact.standoff(offset, angle).x};
}

Pose box_pose(const BoxContact& contact, const PushState& state) {
  const double x = contact.standoff(state.offset, state.angle).x + state.gap;
  const double c = std::cos(state.robot.theta);
  const double s = std::sin(state.robot.theta);
  return {state.robot.x + c * x - s * state.offset, state.robot.y + s * x + c * state.offset,
          state.robot.theta + state.angle};
}

}  // namespace pushplan::pushing
