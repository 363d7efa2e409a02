#include "pushplan/planners/pushing/push_assembly.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan::pushing {
namespace {

constexpr double kSpeedSmoothness = 0.1;  // cost of a change of speed, against that of turn rate
// cost of departing from the nominal commands, as a fraction of P's mean diagonal: it bounds the
// condition of P, and is nothing once the commands do not change any more
constexpr double kNear = 1e-4;

/// Offset and angle after a step that begins in contact.
Vec2 relative_after(const BoxContact& contact, double offset, double angle, const Twist& twist,
                    double dt) {
  PushState state{{0.0, 0.0, 0.0}, offset, angle, 0.0};
  advance_box(contact, state, twist, dt);
  return {state.offset, state.angle};
}

/// The weighted residuals of one step, whose squares are its cost but for the commands.
std::array<double, kResiduals> residuals(const PushWeights& weights, const mpc::PathErrors& errors,
                                         const PushState& state,
                                         double flush,  // angle at which the box lies on the bumper
                                         const Twist& twist, double factor) {
  const double root = std::sqrt(factor);
  const double fraction = state.offset / weights.half;
  const double beyond = std::max(std::abs(fraction) - weights.safe, 0.0);
  double grip = 0.0;
  if (weights.curvature >= 0.0) {
    const double over = std::max(std::abs(twist.w) - weights.curvature * twist.v, 0.0) *
                        weights.length / weights.max_speed;
    grip = root * std::sqrt(weights.grip) * (twist.w > 0.0 ? over : -over);
  }
  return {root * errors.offset / weights.length,
          root * std::sqrt(weights.heading) * errors.error,
          root * std::sqrt(weights.offset) * fraction,
          root * std::sqrt(weights.rim) * (fraction > 0.0 ? beyond : -beyond),
          root * std::sqrt(weights.angle) * (state.angle - flush),
          grip};
}

}  // namespace

BoxSlopes linearise(const BoxContact& contact, double offset, double angle, const Twist& twist,
                    double dt, const std::array<double, 4>& widths) {
  // wide enough to see across the edge of the friction cone; of the speed from 0 on only
  BoxSlopes slopes{};
  for (std::size_t j = 0; j < 4; ++j) {
    const double high = widths[j];
    const double low = j == 2 ? std::min(high, twist.v) : high;
    const auto moved_by = [&](double by) {
      return relative_after(contact, offset + (j == 0 ? by : 0.0), angle + (j == 1 ? by : 0.0),
                            {twist.v + (j == 2 ? by : 0.0), twist.w + (j == 3 ? by : 0.0)}, dt);
    };
    const Vec2 a = moved_by(high);
    const Vec2 b = moved_by(-low);
    slopes.offset[j] = (a.x - b.x) / (high + low);
    slopes.angle[j] = (a.y - b.y) / (high + low);
  }
  return slopes;
}

PushAssembly::PushAssembly(Index steps, Index commands)
    : moves_(static_cast<std::size_t>(commands)) {
  const auto rows = static_cast<std::size_t>(kResiduals * steps);
  const std::size_t n = 2 * moves_;
  jacobian_.resize(rows * n);
  residual_.resize(rows);
  slopes_.resize(n);
  product_.resize(n * n);
  pull_.resize(n);
  z_.resize(n);
  row_.resize(n);
}

/// The rows of the Jacobian of step k.
ArrayView<double, 2> PushAssembly::rows_of(std::size_t k) {
  const std::size_t n = 2 * moves_;
  return {jacobian_.data() + static_cast<std::size_t>(kResiduals) * k * n,
          {kResiduals, static_cast<Index>(n)}};
}

/// Carries the derivatives of the state over a step under command g.
void PushAssembly::propagate(const mpc::ArcMotion& motion, const BoxSlopes& slopes,
                             const Twist& units, double dt, std::size_t g) {
  for (StateSlope& row : slopes_) {
    row.x -= motion.by.y * row.theta;
    row.y += motion.by.x * row.theta;
    const double s = row.offset;
    const double a = row.angle;
    row.offset = slopes.offset[0] * s + slopes.offset[1] * a;
    row.angle = slopes.angle[0] * s + slopes.angle[1] * a;
  }
  StateSlope& by_speed = slopes_[g];
  by_speed.x += motion.by_speed.x * units.v;
  by_speed.y += motion.by_speed.y * units.v;
  by_speed.offset += slopes.offset[2] * units.v;
  by_speed.angle += slopes.angle[2] * units.v;
  StateSlope& by_turn = slopes_[moves_ + g];
  by_turn.x += motion.by_turn.x * units.w;
  by_turn.y += motion.by_turn.y * units.w;
  by_turn.theta += dt * units.w;
  by_turn.offset += slopes.offset[3] * units.w;
  by_turn.angle += slopes.angle[3] * units.w;
}

/// Derivatives of the first five residuals of a step.
void PushAssembly::differentiate(const PushingProblem& problem, const PushState& state,
                                 const mpc::PathErrors& errors, double factor,
                                 ArrayView<double, 2> out) const {
  const BoxContact& contact = problem.contact;
  const PushWeights& weights = problem.weights;
  const double s = state.offset;
  const double angle = state.angle;
  const double x = contact.standoff(s, angle).x;
  const double hs = 0.01 * weights.half;
  const double ha = 0.01;
  const double x_s =
      (contact.standoff(s + hs, angle).x - contact.standoff(s - hs, angle).x) / (2.0 * hs);
  const double x_a =
      (contact.standoff(s, angle + ha).x - contact.standoff(s, angle - ha).x) / (2.0 * ha);
  // robot axes on the path's
  const double c = std::cos(state.robot.theta - errors.heading);
  const double n = std::sin(state.robot.theta - errors.heading);
  const double cp = std::cos(errors.heading);
  const double sp = std::sin(errors.heading);
  const double root = std::sqrt(factor);
  const double away = std::max(1.0 - errors.curvature * errors.offset, 0.2);
  const double fraction = s / weights.half;
  const double rim = std::abs(fraction) > weights.safe ? std::sqrt(weights.rim) : 0.0;
  const double slope = (contact.flush_angle(s + hs) - contact.flush_angle(s - hs)) / (2.0 * hs);
  const double by_heading = root * std::sqrt(weights.heading);
  const double by_offset = root * std::sqrt(weights.offset);
  const double by_angle = root * std::sqrt(weights.angle);
  for (std::size_t j = 0; j < slopes_.size(); ++j) {
    const StateSlope& row = slopes_[j];
    if (row.theta == 0.0 && row.x == 0.0 && row.y == 0.0 && row.offset == 0.0) continue;
    // in robot axes
    const double ahead = x_s * row.offset + x_a * row.angle;
    const double left = row.offset;
    const double across =
        cp * row.y - sp * row.x + (c * x - n * s) * row.theta + n * ahead + c * left;
    const double along =
        cp * row.x + sp * row.y - (n * x + c * s) * row.theta + c * ahead - n * left;
    out(0, j) = root * across / weights.length;
    out(1, j) = by_heading * (row.theta + row.angle - errors.curvature * along / away);
    out(2, j) = by_offset * row.offset / weights.half;
    out(3, j) = root * rim * row.offset / weights.half;
    out(4, j) = by_angle * (row.angle - slope * row.offset);
  }
}

/// Adds the cost of a step's commands to P and q. Returns what the nominal ones cost.
double PushAssembly::add_command_costs(const PushingProblem& problem, const Step& step,
                                       std::span<const Twist> nominal, ArrayView<double, 2> hessian,
                                       std::span<double> gradient) const {
  struct Kind {
    double Twist::* of;
    double weight;  // of departing from what the path asks for
    double change;  // weight of a change from the command before
  };
  const PushWeights& weights = problem.weights;
  const auto [k, g, tau, asked] = step;
  const double rate = problem.units.w * weights.length / weights.max_speed;
  const bool first = k == 0 || static_cast<std::size_t>(problem.groups[k - 1]) != g;
  double value = 0.0;
  std::size_t i = g;
  for (const Kind& kind : {Kind{&Twist::v, weights.speed, kSpeedSmoothness},
                           Kind{&Twist::w, weights.turn * rate * rate, rate * rate}}) {
    const double unit = problem.units.*kind.of;
    const double z = nominal[g].*kind.of / unit;
    const double wanted = asked.*kind.of / unit;
    double cost = tau * kind.weight;
    hessian(i, i) += cost;
    gradient[i] -= cost * wanted;
    value += 0.5 * cost * ((z - wanted) * (z - wanted));
    if (first) {
      cost = weights.smoothness * kind.change / std::max(tau, 0.05);
      const double before = (g > 0 ? nominal[g - 1] : problem.last).*kind.of / unit;
      value += 0.5 * cost * ((z - before) * (z - before));
      hessian(i, i) += cost;
      if (g == 0) {
        gradient[i] -= cost * before;
      } else {
        hessian(i - 1, i - 1) += cost;
        hessian(i - 1, i) -= cost;
        hessian(i, i - 1) -= cost;
      }
    }
    i += moves_;
  }
  return value;
}

double PushAssembly::assemble(const PushingProblem& problem, std::span<const Twist> nominal,
                              ArrayView<double, 2> hessian, std::span<double> gradient) {
  const BoxContact& contact = problem.contact;
  const mpc::ReferencePath& track = problem.track;
  const PushWeights& weights = problem.weights;
  const Twist& units = problem.units;
  const std::size_t count = problem.steps.size();
  std::ranges::fill(jacobian_, 0.0);
  std::fill_n(hessian.data(), hessian.size(), 0.0);
  std::ranges::fill(gradient, 0.0);
  std::ranges::fill(slopes_, StateSlope{0.0, 0.0, 0.0, 0.0, 0.0});
  const std::array<double, 4> widths{0.01 * weights.half, 0.02, 0.05 * units.v,
                                     0.02 * units.v / weights.length};
  PushState here = problem.start;
  // as if the gap had closed already
  here.robot.x += problem.start.gap * std::cos(problem.start.robot.theta);
  here.robot.y += problem.start.gap * std::sin(problem.start.robot.theta);
  here.gap = 0.0;
  double value = 0.0;
  const double unit = weights.length / weights.max_speed;  // T [s]
  Pose box = box_pose(contact, here);
  mpc::PathPlace place = mpc::locate(track, {box.x, box.y}, problem.along, problem.along);
  double curvature = mpc::errors(track, {box.x, box.y, here.robot.theta}, place).curvature;
  place.along = problem.along;
  for (std::size_t k = 0; k < count; ++k) {
    const double dt = problem.steps[k];
    const auto g = static_cast<std::size_t>(problem.groups[k]);
    const Twist twist = nominal[g];
    const double tau = dt / unit;
    double wanted =
        std::min(track.speeds[static_cast<std::size_t>(place.index)], weights.max_speed);
    wanted = std::min(wanted, std::max(track.length() - place.along, 0.0) / dt);
    const double turn = std::min(std::max(wanted * curvature, -units.w), units.w);
    const BoxSlopes slopes = linearise(contact, here.offset, here.angle, twist, dt, widths);
    propagate(mpc::arc(here.robot, twist, dt), slopes, units, dt, g);
    advance(contact, here, twist, dt);
    here.gap = 0.0;
    box = box_pose(contact, here);
    place =
        mpc::locate(track, {box.x, box.y}, place.along, place.along + 2.0 * twist.v * dt + 1e-9);
    const mpc::PathErrors found = mpc::errors(track, box, place);
    curvature = found.curvature;
    const double factor = tau * (k == count - 1 ? weights.terminal : 1.0);
    const auto step =
        residuals(weights, found, here, contact.flush_angle(here.offset), twist, factor);
    std::ranges::copy(step, residual_.begin() + static_cast<Index>(k) * kResiduals);
    const ArrayView<double, 2> rows = rows_of(k);
    differentiate(problem, here, found, factor, rows);
    if (step[5] != 0.0) {
      const double sign = std::sqrt(factor * weights.grip) * weights.length / weights.max_speed;
      rows(5, moves_ + g) = sign * units.w;
      rows(5, g) = sign * (step[5] > 0.0 ? -weights.curvature : weights.curvature) * units.v;
    }
    value += add_command_costs(problem, {k, g, tau, {wanted, turn}}, nominal, hessian, gradient);
  }
  for (const double r : residual_) value += 0.5 * r * r;
  square(problem, nominal, hessian, gradient);
  return value;
}

/// Adds J'J to P and J'(r - J z) to q by loops over what is not zero: a threaded matrix product
/// waits longer than it computes.
void PushAssembly::square(const PushingProblem& problem, std::span<const Twist> nominal,
                          ArrayView<double, 2> hessian, std::span<double> gradient) {
  const std::size_t n = gradient.size();
  // in the order v_0, w_0, v_1, ..: no command after its step
  std::ranges::fill(product_, 0.0);
  std::ranges::fill(pull_, 0.0);
  const auto variable = [&](std::size_t i) { return i / 2 + moves_ * (i % 2); };
  for (std::size_t i = 0; i < n; ++i) {
    const Twist& command = nominal[i / 2];
    z_[i] = i % 2 == 0 ? command.v / problem.units.v : command.w / problem.units.w;
  }
  for (std::size_t r = 0; r < residual_.size(); ++r) {
    const Index group = problem.groups[r / static_cast<std::size_t>(kResiduals)];
    const auto used = static_cast<std::size_t>(2 * (group + 1));
    const double* jacobian = jacobian_.data() + r * n;
    double left = residual_[r];
    for (std::size_t i = 0; i < used; ++i) {
      row_[i] = jacobian[variable(i)];
      left -= row_[i] * z_[i];
    }
    for (std::size_t i = 0; i < used; ++i) {
      const double part = row_[i];
      if (part == 0.0) continue;
      pull_[i] += part * left;
      double* target = product_.data() + i * n;
      for (std::size_t j = 0; j <= i; ++j) target[j] += part * row_[j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = variable(i);
    gradient[a] += pull_[i];
    for (std::size_t j = 0; j <= i; ++j) {
      const std::size_t b = variable(j);
      hessian(a, b) += product_[i * n + j];
      if (i != j) hessian(b, a) += product_[i * n + j];
    }
  }
  double keep = 0.0;
  for (std::size_t i = 0; i < n; ++i) keep += kNear * hessian(i, i) / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = variable(i);
    hessian(a, a) += keep;
    gradient[a] -= keep * z_[i];
  }
}

}  // namespace pushplan::pushing
