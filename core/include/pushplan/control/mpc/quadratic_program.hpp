// Small dense quadratic programs in bounded commands and bounded changes, solved by OSQP.
//
// Stellato, Banjac, Goulart, Bemporad and Boyd (Math. Program. Comput. 12(4), 2020). OSQP is set up
// once, updated in each call, and begun with the multipliers of the last one.
#pragma once

#include <memory>
#include <vector>

#include "pushplan/array.hpp"

namespace pushplan::mpc {

/// How a controller solves its programs.
struct SolverSettings {
  double tolerance = 1e-6;  // absolute and relative
  Index iterations = 2000;  // after which the solver gives up
  Index rounds = 1;         // programs for each command
  Index first_rounds = 4;   // programs for a command without a solution to start from
};

/// Minimise 1/2 x'Px + q'x over n >= 2 commands in blocks of M >= 2. A caller fills P, q, bounds
/// and start.
class QuadraticProgram {
 public:
  QuadraticProgram(Index variables,            // n
                   Index moves,                // M
                   std::vector<Index> blocks,  // see below
                   const SolverSettings& settings);
  QuadraticProgram(QuadraticProgram&&) noexcept;
  QuadraticProgram& operator=(QuadraticProgram&&) noexcept;
  ~QuadraticProgram();

  /// Minimises from `x`, in place. False if OSQP does not call its answer solved.
  bool solve();

  ArrayView<double, 2> hessian() {
    const auto n = static_cast<Index>(x.size());
    return {curvatures.data(), {n, n}};
  }

  Index moves;                     // M
  std::vector<Index> blocks;       // (B,) first variable of each block whose changes are bounded
  std::vector<double> curvatures;  // (n n,) P, of which the upper half counts
  std::vector<double> gradient;    // (n,) q
  std::vector<double> low;         // (n + B M,) bounds of the variables, then of their changes
  std::vector<double> high;
  std::vector<double> x;  // (n,) start, and solution

 private:
  struct Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace pushplan::mpc
