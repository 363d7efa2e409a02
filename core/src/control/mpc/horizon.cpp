#include "pushplan/control/mpc/horizon.hpp"

#include <algorithm>

namespace pushplan::mpc {

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
      const double before = i == 0 ? (is_speed ? last->v : last->w) / unit : 0.0;
      program.low[row + i] = before - reach;
      program.high[row + i] = before + reach;
    }
  }
}

void Horizon::keep_solution() {
  counts->known = 1;
  std::ranges::copy(nominal, solution.begin());
  std::ranges::copy(steps, solved.begin());
}

Twist Horizon::send(const Twist& wanted, double held, bool ramps) {
  Twist command = wanted;
  if (ramps) {
    const double dv = limits.max_acceleration * held;
    const double dw = limits.max_turn_acceleration * held;
    command.v = std::min(std::max(command.v, last->v - dv), last->v + dv);
    command.w = std::min(std::max(command.w, last->w - dw), last->w + dw);
  }
  if (limits.constant) command.v = limits.max_speed;
  command.v = std::min(std::max(command.v, limits.min_speed), limits.max_speed);
  double most = limits.max_turn_rate;
  if (limits.turning_radius > 0.0) {
    most = std::min(most, std::abs(command.v) / limits.turning_radius);
  }
  command.w = std::min(std::max(command.w, -most), most);
  *last = command;
  return command;
}

void Horizon::remember(double time, double over) {
  const Index count = counts->under_way;
  const Index room = static_cast<Index>(sent.size());
  const auto followed = [&](Index i) {  // the command after it was sent by `over`
    return i + 1 < count && sent[static_cast<std::size_t>(i + 1)].time < over;
  };
  Index drop = 0;
  while (drop < count && (count - drop >= room || followed(drop))) ++drop;
  std::copy(sent.begin() + drop, sent.begin() + count, sent.begin());
  sent[static_cast<std::size_t>(count - drop)] = {time, *last};
  counts->under_way = count - drop + 1;
}

}  // namespace pushplan::mpc
