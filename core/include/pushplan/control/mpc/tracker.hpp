// The predictive tracker: from a pose to a command.
//
// The robot's motion under a constant twist is an exact arc, so the prediction has no
// discretisation error. Offset and heading error are linearised about a nominal motion (the last
// solution, moved on in time), which is a Gauss-Newton step of the nonlinear problem: the real-time
// iteration of Diehl, Bock and Schloeder (SIAM J. Control Optim. 43(5), 2005). The states are
// eliminated, which leaves a problem in the inputs alone whose constraints never change and can
// always be met.
#pragma once

#include <vector>

#include "pushplan/control/mpc/horizon.hpp"

namespace pushplan::mpc {

/// Limits of the robot and weights of the cost, which `MpcConfig` in Python describes.
struct Tuning {
  double size;              // R, circumscribed radius [m]
  double max_speed;         // [m/s]
  double max_turn_rate;     // [rad/s]
  double max_acceleration;  // [m/s^2]
  bool stops;               // the robot stops at the end of the path
  bool optimise_speed;
  double heading_weight = 0.5;
  double turn_weight = 0.02;
  double smoothness = 0.001;
  double terminal = 4.0;
  double speed_weight = 0.2;
};

/// Puts up the tracking problem: P and q of min 1/2 z'Pz + q'z over
/// z = (w_0 .. w_N-1 [, v_0 .. v_N-1]), as fractions of the greatest.
class TrackingAssembly {
 public:
  /// For `variables` n: N, or 2 N where the speed is optimised.
  explicit TrackingAssembly(Index variables);

  /// Fills P and q. Nominal commands of NaN are filled with what the path asks for.
  void assemble(const ReferencePath& track, const Tuning& tuning,
                const Pose& pose,     // where the robot is when the first command takes effect
                double along,         // path length of its place on the path [m]
                const Twist& before,  // the command before the first
                std::span<const double> steps,  // (N,) how long each command is held [s]
                std::span<Twist> nominal,       // (N,) to linearise about
                ArrayView<double, 2> hessian, std::span<double> gradient);

 private:
  struct StateSlope {  // of one variable
    double x;
    double y;
    double theta;
  };

  void carry_over(std::size_t k, const ArcMotion& motion, double dt, std::size_t count,
                  const Tuning& tuning);

  std::vector<StateSlope> jacobian_;    // (n,) d(x, y, theta)/dz
  std::vector<double> offset_slopes_;   // (n,) d offset/dz
  std::vector<double> heading_slopes_;  // (n,) d heading error/dz
};

/// A tracker of one robot with its state: `follow` gives a command, and allocates nothing.
class Tracker {
 public:
  Tracker(const CommandLimits& limits, const Tuning& tuning, const SolverSettings& solver,
          Index steps,           // N
          double span,           // time that they reach, if none is shorter than the period [s]
          double delay,          // between a command and its effect [s]
          const Twist& before);  // the command in force

  /// Begins a path.
  void begin_track();

  /// The command for where the robot is: of the solution, or what is nearest to it without one. A
  /// pose that is not finite, or an empty path, gives a stop, or the least speed.
  Twist follow(const ReferencePath& track, const Pose& pose,
               double time,   // of the pose [s]
               double held);  // from the last call to this one [s]

  /// The commands ahead, and how often the solver has failed.
  Horizon& horizon() { return horizon_; }

 private:
  Twist command_for(const ReferencePath& track, const Pose& pose, double time, double held);
  void shift(double held);
  void predict(const Pose& pose, double time);
  Twist fall_back(const ReferencePath& track, const Pose& pose, double held);

  Horizon horizon_;
  Tuning tuning_;
  double span_;
  double delay_;
  Pose pose_{0.0, 0.0, 0.0};  // where the robot is when the next command takes effect
  double place_ = 0.0;        // path length of its place on the path [m]
  TrackingAssembly assembly_;
};

}  // namespace pushplan::mpc
