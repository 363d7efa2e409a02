#include "pushplan/control/mpc/horizon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace pushplan::mpc {
namespace {

// heading errors from which a robot turns towards the path first [rad]
constexpr double kTurnStopped = 0.25 * std::numbers::pi;
constexpr double kTurnDriving = 0.5 * std::numbers::pi;
constexpr std::size_t kSent =
    256;  // commands under way; of more than these the oldest count no more

/// The first variables of the blocks whose changes the robot limits.
std::vector<Index> limited_blocks(const CommandLimits& limits, std::span<const Index> columns,
                                  Index moves) {
  std::vector<Index> blocks;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const double rate = columns[c] == 0 ? limits.max_acceleration : limits.max_turn_acceleration;
    if (std::isfinite(rate)) blocks.push_back(static_cast<Index>(c) * moves);
  }
  return blocks;
}

}  // namespace

Twist CommandLimits::nearest(const Twist& wanted, const Twist& last, double held,
                             bool ramps) const {
  Twist command = wanted;
  if (ramps) {
    const double dv = max_acceleration * held;
    const double dw = max_turn_acceleration * held;
    command.v = std::min(std::max(command.v, last.v - dv), last.v + dv);
    command.w = std::min(std::max(command.w, last.w - dw), last.w + dw);
  }
  if (constant) command.v = max_speed;
  command.v = std::min(std::max(command.v, min_speed), max_speed);
  double most = max_turn_rate;
  if (turning_radius > 0.0) most = std::min(most, std::abs(command.v) / turning_radius);
  command.w = std::min(std::max(command.w, -most), most);
  return command;
}

Twist CommandLimits::at_end(const ReferencePath& track, double heading, double held) const {
  if (std::isnan(track.last_heading)) return {0.0, 0.0};
  const double left = wrap_angle(track.last_heading - heading);
  const double slowing = max_turn_acceleration * held;
  double most = std::min(max_turn_rate, std::abs(left) / held);
  if (std::isfinite(slowing)) {  // so that it falls to 0 within what is left
    const double half = 0.5 * slowing;
    const double square = half * half + 2.0 * max_turn_acceleration * std::abs(left);
    most = std::min(most, std::sqrt(square) - half);
  }
  return {0.0, std::copysign(most, left)};
}

double CommandLimits::turn_from() const {
  const bool on_the_spot = !constant && turning_radius == 0.0;
  return on_the_spot ? kTurnStopped : kTurnDriving;
}

double CommandLimits::turning_speed() const {
  return std::min(max_speed, max_turn_rate * turning_radius);
}

Horizon::Horizon(const CommandLimits& limits_, std::vector<Index> columns_, Index count_,
                 Index moves, const SolverSettings& solver_, const Twist& before)
    : limits(limits_),
      units{limits.max_speed, limits.max_turn_rate},
      columns(std::move(columns_)),
      solver(solver_),
      program(static_cast<Index>(columns.size()) * moves, moves,
              limited_blocks(limits, columns, moves), solver),
      steps(static_cast<std::size_t>(count_)),
      solved(steps.size()),
      shifted(steps.size()),
      solution(static_cast<std::size_t>(moves)),
      nominal(solution.size()),
      last(before),
      sent(kSent) {}

/// Solves the program from the nominal commands, and replaces them; false if it is not solved.
bool Horizon::solve_about_nominal() {
  const auto for_each_variable = [&](const auto& visit) {
    std::size_t i = 0;
    for (const Index column : columns) {
      double Twist::* const part = column == 0 ? &Twist::v : &Twist::w;
      for (Twist& command : nominal) visit(program.x[i++], command.*part, units.*part);
    }
  };
  for_each_variable([](double& x, const double& command, double unit) { x = command / unit; });
  if (!program.solve()) return false;
  for_each_variable([](const double& x, double& command, double unit) { command = x * unit; });
  return true;
}

void Horizon::lay_steps(double span, double held) {
  const double part = span / static_cast<double>(steps.size());
  for (std::size_t k = 0; k < steps.size(); ++k) steps[k] = k == 0 ? held : std::max(held, part);
}

void Horizon::shift_steps(double held) {
  const std::size_t count = steps.size();
  std::size_t index = 0;
  double end = solved[0];
  double begin = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const double middle = begin + steps[k] - 0.5 * steps[k];
    while (index < count && end - held < middle) {
      ++index;
      if (index < count) end += solved[index];
    }
    shifted[k] = static_cast<Index>(index);
    begin += steps[k];
  }
}

void Horizon::set_bounds(double first, double later) {
  const std::size_t n = program.x.size();
  const auto moves = static_cast<std::size_t>(program.moves);
  std::fill_n(program.low.begin(), n, -1.0);
  std::fill_n(program.high.begin(), n, 1.0);
  for (std::size_t b = 0; b < program.blocks.size(); ++b) {
    const bool is_speed = columns[static_cast<std::size_t>(program.blocks[b] / program.moves)] == 0;
    const double rate = is_speed ? limits.max_acceleration : limits.max_turn_acceleration;
    const double unit = is_speed ? units.v : units.w;
    const std::size_t row = n + b * moves;
    for (std::size_t i = 0; i < moves; ++i) {
      const double reach = rate / unit * (i == 0 ? first : later);
      const double before = i == 0 ? (is_speed ? last.v : last.w) / unit : 0.0;
      program.low[row + i] = before - reach;
      program.high[row + i] = before + reach;
    }
  }
}

void Horizon::keep_solution() {
  known = true;
  std::ranges::copy(nominal, solution.begin());
  std::ranges::copy(steps, solved.begin());
}

Twist Horizon::send(const Twist& wanted, double held, bool ramps) {
  last = limits.nearest(wanted, last, held, ramps);
  return last;
}

void Horizon::remember(double time, double over) {
  const auto count = static_cast<Index>(under_way_count);
  const Index room = static_cast<Index>(sent.size());
  const auto followed = [&](Index i) {  // the command after it was sent by `over`
    return i + 1 < count && sent[static_cast<std::size_t>(i + 1)].time < over;
  };
  Index drop = 0;
  while (drop < count && (count - drop >= room || followed(drop))) ++drop;
  std::copy(sent.begin() + drop, sent.begin() + count, sent.begin());
  sent[static_cast<std::size_t>(count - drop)] = {time, last};
  under_way_count = static_cast<std::size_t>(count - drop + 1);
}

}  // namespace pushplan::mpc
