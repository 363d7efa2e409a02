"""A small dense quadratic program whose constraints keep their structure."""

from __future__ import annotations

import numpy as np

from pushplan.control.mpc.qp_kernels import qp_memory, solve_program
from pushplan.world.checks import FloatArray


class QuadraticProgram:
    """min 1/2 zᵀPz + qᵀz with low <= (z, changes of z) <= high, solved again and again.

    The operator splitting of OSQP (Stellato et al., Math. Program. Comput. 12(4), 2020); each
    call starts from the multipliers and the step size of the last one. The step size is adapted
    after fixed numbers of iterations and never by the clock, so that runs repeat.

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
        firsts = np.flatnonzero(limited).astype(np.int64) * horizon
        self.count = blocks * horizon
        """Number of variables."""
        self.memory = qp_memory(self.count, horizon, firsts, tolerance, iterations)
        self.rows = len(self.memory.y)
        """Number of constraints: the inputs, then the changes of the limited ones."""

    def solve(
        self,
        hessian: FloatArray,
        gradient: FloatArray,
        low: FloatArray,
        high: FloatArray,
        start: FloatArray,
    ) -> FloatArray | None:
        """The minimiser, or None where it is not found.

        Args:
            hessian: (n, n) P.
            gradient: (n,) q.
            low: (rows,) lower bounds.
            high: (rows,) upper bounds.
            start: (n,) what to start from.
        """
        memory = self.memory
        memory.hessian[:], memory.gradient[:] = hessian, gradient
        memory.low[:], memory.high[:], memory.x[:] = low, high, start
        return memory.x.copy() if solve_program(memory) else None
