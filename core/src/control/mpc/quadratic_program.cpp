#include "pushplan/control/mpc/quadratic_program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "osqp.h"
#include "osqp/amd.h"

/// Programs of commands need no search for an order: bounds and changes have one or two variables,
/// so taken first they fill in nothing but P, which is dense. The order among them is the one that
/// AMD finds, and results are those of OSQP as its package comes.
int amd_order(int size, const int* starts, const int* rows, int* order, double*, double*) {
  const auto entries = [&](int column) { return starts[column + 1] - starts[column]; };
  int variables = 1;
  while (entries(variables) == variables + 1) ++variables;
  const int changes = 2 * variables;  // the bounds come in between
  // the variable that a change leads to: the last one above the diagonal
  const auto changed = [&](int change) { return rows[starts[change + 1] - 2]; };
  int change = changes;
  for (int i = 0; i < variables; ++i) {
    if (change < size && changed(change) == i) {
      ++change;
    } else {
      *order++ = variables + i;
    }
  }
  for (change = changes; change < size; ++change) {
    const int bound = variables + changed(change);
    const bool ends_block = change + 1 == size || entries(change + 1) == 2;
    *order++ = ends_block ? bound : change;
    *order++ = ends_block ? change : bound;
  }
  const int last = changes < size ? changed(changes) + 1 : 0;
  for (int i = 0; i < variables; ++i) {
    if (i != last) *order++ = i;
  }
  *order = last;
  return 0;
}

namespace pushplan::mpc {
namespace {

// of iterations after which the step size adapts: by time, one input would have several answers
constexpr OSQPInt kAdaptiveRhoInterval = 20;
constexpr OSQPInt kCheckTermination = 5;  // iterations

/// A sparse matrix, column by column.
struct Columns {
  std::vector<OSQPInt> starts{0};
  std::vector<OSQPInt> rows;
  std::vector<double> values;

  void add(Index row, double value) {
    rows.push_back(static_cast<OSQPInt>(row));
    values.push_back(value);
  }
  void end_column() { starts.push_back(static_cast<OSQPInt>(rows.size())); }

  OSQPCscMatrix matrix(Index row_count) {
    OSQPCscMatrix made;
    OSQPCscMatrix_set_data(&made, static_cast<OSQPInt>(row_count),
                           static_cast<OSQPInt>(starts.size()) - 1,
                           static_cast<OSQPInt>(rows.size()), values.data(), rows.data(),
                           starts.data());
    return made;
  }
};

/// The pattern of P: its upper half.
Columns upper_half(Index count) {
  Columns half;
  for (Index column = 0; column < count; ++column) {
    for (Index row = 0; row <= column; ++row) half.add(row, 1.0);
    half.end_column();
  }
  return half;
}

/// A: the variables, then the changes of blocks.
Columns bounded_rows(Index count, Index moves, std::span<const Index> blocks) {
  Columns bounded;
  for (Index column = 0; column < count; ++column) {
    bounded.add(column, 1.0);
    Index row = count;
    for (const Index first : blocks) {
      const Index i = column - first;
      if (i >= 0 && i < moves) bounded.add(row + i, 1.0);
      if (i >= 0 && i + 1 < moves) bounded.add(row + i + 1, -1.0);
      row += moves;
    }
    bounded.end_column();
  }
  return bounded;
}

/// The sum of P's diagonal, in eight sums side by side as NumPy has it.
double trace(const ArrayView<double, 2>& matrix) {
  const Index count = matrix.extent(0);
  const Index even = count - count % 8;
  std::array<double, 8> sums{};
  for (Index i = 0; i < even; ++i) sums[static_cast<std::size_t>(i % 8)] += matrix(i, i);
  double sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) +
               ((sums[4] + sums[5]) + (sums[6] + sums[7]));
  for (Index i = even; i < count; ++i) sum += matrix(i, i);
  return sum;
}

bool all_finite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

}  // namespace

/// OSQP, and the numbers that it is given.
struct QuadraticProgram::Solver {
  Solver(Index count, Index moves, std::span<const Index> blocks, const SolverSettings& settings);
  ~Solver() { osqp_cleanup(osqp); }

  OSQPSolver* osqp = nullptr;
  std::vector<double> upper;     // P, its upper half column by column, scaled
  std::vector<double> gradient;  // q, scaled
  std::vector<double> zeros;     // of the multipliers
};

QuadraticProgram::Solver::Solver(Index count, Index moves, std::span<const Index> blocks,
                                 const SolverSettings& settings)
    : gradient(static_cast<std::size_t>(count)) {
  const Index row_count = count + static_cast<Index>(blocks.size()) * moves;
  zeros.resize(static_cast<std::size_t>(row_count));
  Columns half = upper_half(count);
  Columns bounded = bounded_rows(count, moves, blocks);
  upper = half.values;
  OSQPSettings chosen;
  osqp_set_default_settings(&chosen);
  chosen.scaling = 0;  // the commands have their own units
  chosen.adaptive_rho_interval = kAdaptiveRhoInterval;
  chosen.check_termination = kCheckTermination;
  chosen.eps_abs = settings.tolerance;
  chosen.eps_rel = settings.tolerance;
  chosen.max_iter = static_cast<OSQPInt>(settings.iterations);
  chosen.verbose = 0;
  const std::vector<double> low(zeros.size(), -1.0);
  const std::vector<double> high(zeros.size(), 1.0);
  const OSQPCscMatrix p = half.matrix(count);
  const OSQPCscMatrix a = bounded.matrix(row_count);
  if (osqp_setup(&osqp, &p, gradient.data(), &a, low.data(), high.data(), a.m, a.n, &chosen) != 0) {
    osqp_cleanup(osqp);
    throw std::invalid_argument("settings of the solver that OSQP does not take");
  }
}

QuadraticProgram::QuadraticProgram(Index variables, Index moves_, std::vector<Index> blocks_,
                                   const SolverSettings& settings)
    : moves(moves_),
      blocks(std::move(blocks_)),
      curvatures(static_cast<std::size_t>(variables * variables)),
      gradient(static_cast<std::size_t>(variables)),
      x(static_cast<std::size_t>(variables)),
      solver_(std::make_unique<Solver>(variables, moves, blocks, settings)) {
  low.assign(solver_->zeros.size(), -1.0);
  high.assign(solver_->zeros.size(), 1.0);
}

QuadraticProgram::QuadraticProgram(QuadraticProgram&&) noexcept = default;
QuadraticProgram& QuadraticProgram::operator=(QuadraticProgram&&) noexcept = default;
QuadraticProgram::~QuadraticProgram() = default;

bool QuadraticProgram::solve() {
  const ArrayView<double, 2> p = hessian();
  const double total = trace(p);
  if (!all_finite(curvatures) || !all_finite(gradient) || !(total > 0.0)) return false;
  const double scale = static_cast<double>(x.size()) / total;  // one step size suits any horizon
  OSQPSolver* osqp = solver_->osqp;
  auto upper = solver_->upper.begin();
  for (Index column = 0; column < p.extent(0); ++column) {
    for (Index row = 0; row <= column; ++row) *upper++ = scale * p(row, column);
  }
  std::ranges::transform(gradient, solver_->gradient.begin(), [&](double q) { return scale * q; });
  osqp_update_data_vec(osqp, solver_->gradient.data(), low.data(), high.data());
  osqp_update_data_mat(osqp, solver_->upper.data(), nullptr,
                       static_cast<OSQPInt>(solver_->upper.size()), nullptr, nullptr, 0);
  osqp_warm_start(osqp, x.data(), nullptr);
  osqp_solve(osqp);
  const OSQPInt status = osqp->info->status_val;
  if (status == OSQP_PRIMAL_INFEASIBLE || status == OSQP_PRIMAL_INFEASIBLE_INACCURATE) {
    osqp_warm_start(osqp, nullptr, solver_->zeros.data());
  }
  if (status != OSQP_SOLVED) return false;
  std::copy_n(osqp->solution->x, x.size(), x.begin());
  return true;
}

}  // namespace pushplan::mpc
