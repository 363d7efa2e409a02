"""OSQP for a small dense quadratic program whose constraints keep their structure."""

from __future__ import annotations

from typing import Any

import numpy as np

from pushplan.world.checks import FloatArray

RHO = 0.1
"""First step size of the operator splitting; adapted after a fixed number of iterations."""
RHO_INTERVAL = 20
CHECK_INTERVAL = 5
_BY_ITERATIONS = 1  # OSQP_ADAPTIVE_RHO_UPDATE_ITERATIONS; 2 would be by the clock


class QuadraticProgram:
    """min 1/2 zᵀPz + qᵀz with low <= (z, changes of z) <= high, solved again and again by OSQP.

    Set up once; `solve` changes values only and starts from the last solution. The step size is
    adapted after fixed numbers of iterations and never by the clock, so that runs repeat.
    Stellato et al., "OSQP: an operator splitting solver for quadratic programs", 2020.

    Args:
        blocks: how many inputs there are; each has N values.
        horizon: N.
        limited: for each input, whether its changes have limits.
        tolerance: absolute and relative.
        iterations: after which it gives up.
    """

    def __init__(
        self,
        blocks: int,
        horizon: int,
        limited: tuple[bool, ...],
        *,
        tolerance: float = 1e-6,
        iterations: int = 2000,
    ) -> None:
        import osqp  # not loaded by those who do not need it
        from scipy import sparse

        count = blocks * horizon
        change = sparse.eye_array(horizon) - sparse.eye_array(horizon, k=-1)
        rows: list[Any] = [sparse.eye_array(count)]
        for block in range(blocks):
            if limited[block]:
                pick = sparse.csr_array(np.eye(blocks)[block][None])
                rows.append(sparse.kron(pick, change))
        self._upper = np.triu_indices(count)
        order = np.lexsort(self._upper)  # column by column
        self._upper = (self._upper[0][order], self._upper[1][order])
        pattern = sparse.csc_matrix(np.triu(np.ones((count, count))))
        constraints = sparse.csc_matrix(sparse.vstack(rows))
        self.rows = constraints.shape[0]
        """Number of constraints: the inputs, then the changes of the limited ones."""
        self.count = count
        """Number of variables."""
        self._solved = int(osqp.SolverStatus.OSQP_SOLVED)
        self._solver: Any = osqp.OSQP()
        pattern.data[:] = self._packed(np.eye(count))
        self._solver.setup(
            pattern,
            np.zeros(count),
            constraints,
            -np.ones(self.rows),
            np.ones(self.rows),
            verbose=False,
            eps_abs=tolerance,
            eps_rel=tolerance,
            max_iter=iterations,
            rho=RHO,
            adaptive_rho=_BY_ITERATIONS,
            adaptive_rho_interval=RHO_INTERVAL,
            check_termination=CHECK_INTERVAL,
            scaling=0,
            polishing=False,
            warm_starting=True,
        )

    def _packed(self, hessian: FloatArray) -> FloatArray:
        packed: FloatArray = hessian[self._upper]
        return packed

    def solve(
        self,
        hessian: FloatArray,
        gradient: FloatArray,
        low: FloatArray,
        high: FloatArray,
        start: FloatArray,
    ) -> FloatArray | None:
        """The minimiser, or None where OSQP does not say that it has solved the problem.

        Args:
            hessian: (n, n) P.
            gradient: (n,) q.
            low: (rows,) lower bounds.
            high: (rows,) upper bounds.
            start: (n,) what to start from.
        """
        # the binding itself: its wrapper in Python takes three times as long as the solver
        solver = self._solver._solver
        scale = self.count / np.trace(hessian)  # so that the step size suits any horizon
        solver.update_data_vec(q=scale * gradient, l=low, u=high)
        packed = scale * self._packed(hessian)
        solver.update_data_mat(P_x=packed, P_i=None, A_x=None, A_i=None)
        solver.warm_start(start, None)
        solver.solve()
        found: FloatArray = np.array(solver.solution.x)
        if solver.info.status_val != self._solved or not np.isfinite(found).all():
            return None
        return found
