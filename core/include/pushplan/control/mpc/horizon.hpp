// Time grid, bounds and commands of predictive controllers about their last solution.
#pragma once

#include <span>
#include <vector>

#include "pushplan/control/mpc/quadratic_program.hpp"
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

  /// The nearest command within the limits, held for a time [s] after another one; `ramps`: within
  /// the accelerations too.
  Twist nearest(const Twist& wanted, const Twist& last, double held, bool ramps) const;
  /// The command at the end of a path: a stop, or a turn on the spot that ends at its last heading.
  Twist at_end(const ReferencePath& track, double heading, double held) const;
  /// The heading error from which the robot turns towards the path first [rad].
  double turn_from() const;
  /// The speed at which a robot that can stop turns as fast as it can [m/s].
  double turning_speed() const;
};

/// A command that has been sent.
struct SentCommand {
  double time;  // [s]
  Twist twist;
};

/// Commands for the next steps, from quadratic programs about the last solution.
struct Horizon {
  Horizon(const CommandLimits& limits,
          std::vector<Index> columns,  // what each block of variables is: 0 speed, 1 turn rate
          Index count,                 // N, steps
          Index moves,                 // M, commands of each variable
          const SolverSettings& solver,
          const Twist& before);  // the command in force

  CommandLimits limits;
  Twist units;                 // of speed and turn rate in the program
  std::vector<Index> columns;  // (C,)
  SolverSettings solver;
  QuadraticProgram program;       // over M commands of each, in units
  std::vector<double> steps;      // (N,) how long each step is [s]
  std::vector<double> solved;     // (N,) the same when the last solution was found
  std::vector<Index> shifted;     // (N,) the step of then that each one lies in; N past the end
  std::vector<Twist> solution;    // (M,)
  std::vector<Twist> nominal;     // (M,) what the next program is about
  Twist last;                     // the command before the first
  std::vector<SentCommand> sent;  // commands under way, the first `under_way_count` count
  std::size_t under_way_count = 0;
  bool known = false;  // there is a solution
  Index missed = 0;    // failures of the solver since
  Index failed = 0;    // and ever

  Index count() const { return static_cast<Index>(steps.size()); }
  /// The commands under way.
  std::span<const SentCommand> under_way() const { return std::span(sent).first(under_way_count); }

  /// Sets the steps: the first until the next call, `held`, the others a part of `span` [s].
  void lay_steps(double span, double held);
  /// Sets which step of the last solution each one lies in, `held` [s] later.
  void shift_steps(double held);
  /// Bounds the commands, +-1, and by what they change in times [s], in the program's units.
  void set_bounds(double first, double later);
  /// Makes the nominal commands a solution of programs that `assemble` puts up about them. False if
  /// the solver does not find one.
  template <class Assemble>
  bool solve(const Assemble& assemble) {
    const Index rounds = known ? solver.rounds : solver.first_rounds;
    for (Index i = 0; i < rounds; ++i) {
      assemble();
      if (!solve_about_nominal()) return false;
    }
    return true;
  }
  /// Keeps the nominal commands as the solution for the present steps.
  void keep_solution();
  /// The nearest command within the limits, held for a time [s]; remembers it as the last. With
  /// `ramps` it is within the accelerations too.
  Twist send(const Twist& wanted, double held, bool ramps);
  /// Adds the last command, sent at `time`, and drops those that another followed by `over`.
  void remember(double time, double over);

 private:
  bool solve_about_nominal();
};

}  // namespace pushplan::mpc
