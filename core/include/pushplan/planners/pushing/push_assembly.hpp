// The pushing problem: from a path and nominal commands to P and q.
//
// A Gauss-Newton step of the nonlinear problem about the last solution: the real-time iteration of
// Diehl, Bock and Schloeder (SIAM J. Control Optim. 43(5), 2005), as Hogan and Rodriguez (WAFR
// 2016) and Tang et al. (arXiv 2309.14295) use model-predictive control for pushing. States are
// eliminated, which leaves a problem in the commands alone whose constraints can always be met.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "pushplan/planners/pushing/box_motion.hpp"

namespace pushplan::pushing {

/// Costs and scales of the cost.
struct PushWeights {
  double length;     // L, from the axle to the box's centre [m]
  double max_speed;  // [m/s]
  double half;       // half the bumper, as far as offsets may reach [m]
  double curvature;  // greatest that is used without a cost [1/m]; negative where there is no limit
  double heading;
  double offset;
  double rim;
  double safe;  // fraction of half the bumper within which an offset costs no more than `offset`
  double angle;
  double grip;
  double turn;
  double speed;
  double smoothness;
  double terminal;
};

/// The pushing problem of one call; N steps under M commands.
struct PushingProblem {
  BoxContact contact;
  mpc::ReferencePath track;  // of the box
  PushWeights weights;
  PushState start;                // when the first command takes effect
  double along;                   // path length of the box's place [m]
  Twist last;                     // the command before the first
  Twist units;                    // of speed and turn rate in the program
  std::span<const double> steps;  // (N,) [s]
  std::span<const Index> groups;  // (N,) which of the commands holds in each step
};

/// Derivatives of a step: d(offset, angle) after it / d(offset, angle, v, w).
struct BoxSlopes {
  std::array<double, 4> offset;
  std::array<double, 4> angle;
};

/// By central differences of these widths, from contact on.
BoxSlopes linearise(const BoxContact& contact, double offset, double angle, const Twist& twist,
                    double dt, const std::array<double, 4>& widths);

/// Residuals of one step: distance, direction, offset, rim, angle, grip.
inline constexpr Index kResiduals = 6;

/// Puts up pushing problems of one size, with memory for one thread.
class PushAssembly {
 public:
  PushAssembly(Index steps, Index commands);

  /// Fills P and q over z = (v_0 .. v_M-1, w_0 .. w_M-1) in units. Returns the nominal cost.
  double assemble(const PushingProblem& problem, std::span<const Twist> nominal,
                  ArrayView<double, 2> hessian, std::span<double> gradient);

 private:
  struct StateSlope {  // of one variable
    double x;
    double y;
    double theta;
    double offset;
    double angle;
  };
  struct Step {
    std::size_t k;  // its number
    std::size_t g;  // the command that holds in it
    double tau;     // its length [T]
    Twist asked;    // by the path
  };

  ArrayView<double, 2> rows_of(std::size_t k);
  void propagate(const mpc::ArcMotion& motion, const BoxSlopes& slopes, const Twist& units,
                 double dt, std::size_t g);
  void differentiate(const PushingProblem& problem, const PushState& state,
                     const mpc::PathErrors& errors, double factor, ArrayView<double, 2> out) const;
  double add_command_costs(const PushingProblem& problem, const Step& step,
                           std::span<const Twist> nominal, ArrayView<double, 2> hessian,
                           std::span<double> gradient) const;
  void square(const PushingProblem& problem, std::span<const Twist> nominal,
              ArrayView<double, 2> hessian, std::span<double> gradient);

  std::size_t moves_;               // M
  std::vector<double> jacobian_;    // (6 N, 2 M)
  std::vector<double> residual_;    // (6 N,)
  std::vector<StateSlope> slopes_;  // (2 M,)
  std::vector<double> product_;     // (2 M, 2 M)
  std::vector<double> pull_;        // (2 M,)
  std::vector<double> z_;           // (2 M,)
  std::vector<double> row_;         // (2 M,)
};

}  // namespace pushplan::pushing
