// Time grid, bounds and commands of predictive controllers about their last solution.
#pragma once

#include <span>

#include "pushplan/array.hpp"
#include "pushplan/control/mpc/tracking.hpp"

namespace pushplan::mpc {

/// Speed, turn-rate and acceleration limits of a robot.
struct CommandLimits {
  bool constant;  // it always drives at max_speed
  double min_speed;
  double max_speed;              // [m/s]
  double max_turn_rate;          // [rad/s]
  double max_acceleration;       // [m/s^2]
  double max_turn_acceleration;  // [rad/s^2]
  double turning_radius;         // that a car has at any speed [m]; 0 for other drives
};

/// Minimise 1/2 x'Px + q'x over n commands in blocks of M. A solver reads and writes the arrays, so
/// they belong to the caller.
struct QuadraticProgram {
  Index moves;                    // M
  std::span<const Index> blocks;  // (B,) first variable of each block whose changes are bounded
  ArrayView<double, 2> hessian;   // (n, n) P
  std::span<double> gradient;     // (n,) q
  std::span<double> low;          // (n + B M,) bounds of the variables, then of their changes
  std::span<double> high;
  std::span<double> x;  // (n,) start, and solution
};

/// A command that has been sent.
struct SentCommand {
  double time;  // [s]
  Twist twist;
};

struct HorizonCounts {
  Index under_way;  // commands
  Index known;      // 1 if there is a solution
  Index missed;     // failures of the solver since
  Index failed;     // and ever
};

/// Commands for the next steps, from quadratic programs about the last solution. The arrays are
/// shared with the solver's side.
struct Horizon {
  CommandLimits limits;
  Twist units;                     // of speed and turn rate in the program
  std::span<const Index> columns;  // (C,) what each block of variables is: 0 speed, 1 turn rate
  QuadraticProgram program;        // over M commands of each, in units
  std::span<double> steps;         // (N,) how long each step is [s]
  std::span<double> solved;        // (N,) the same when the last solution was found
  std::span<Index> shifted;        // (N,) the step of then that each one lies in; N past the end
  std::span<Twist> solution;       // (M,)
  std::span<Twist> nominal;        // (M,) what the next program is about
  Twist* last;                     // the command before the first
  std::span<SentCommand> sent;  // commands under way; of more than these the oldest count no more
  HorizonCounts* counts;

  Index count() const { return static_cast<Index>(steps.size()); }
  /// The commands under way.
  std::span<const SentCommand> under_way() const {
    return sent.first(static_cast<std::size_t>(counts->under_way));
  }

  /// Sets the steps: the first until the next call, `held`, the others a part of `span` [s].
  void lay_steps(double span, double held);
  /// Sets which step of the last solution each one lies in, `held` [s] later.
  void shift_steps(double held);
  /// Bounds the commands, +-1, and by what they change in times [s], in the program's units.
  void set_bounds(double first, double later);
  /// Keeps the nominal commands as the solution for the present steps.
  void keep_solution();
  /// The nearest command within the limits, held for a time [s]; remembers it as the last. With
  /// `ramps` it is within the accelerations too.
  Twist send(const Twist& wanted, double held, bool ramps);
  /// Adds the last command, sent at `time`, and drops those that another followed by `over`.
  void remember(double time, double over);
};

}  // namespace pushplan::mpc
