"""Small dense quadratic programs in bounded commands and bounded changes, solved by OSQP."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import osqp
from scipy.sparse import csc_matrix

from pushplan.world.checks import FloatArray, IntArray

_SOLVED = osqp.SolverStatus.OSQP_SOLVED
_NO_POINT = (
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE,
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE,
)
_SETTINGS = {
    "scaling": 0,  # the commands have their own units
    "adaptive_rho_interval": 20,  # in iterations: by time, one input would have several answers
    "check_termination": 5,
    "polishing": False,
    "verbose": False,
}


class QuadraticProgram(NamedTuple):
    """Minimise 1/2 xᵀPx + qᵀx over n commands in blocks of M, as the core fills it."""

    moves: int  # M
    blocks: IntArray  # (B,) first variable of each block whose changes are bounded
    hessian: FloatArray  # (n, n) P
    gradient: FloatArray  # (n,) q
    low: FloatArray  # (n + B M,) bounds of the variables, then of their changes
    high: FloatArray
    x: FloatArray  # (n,) start, and solution


def quadratic_program(count: int, moves: int, blocks: IntArray) -> QuadraticProgram:
    """Memory for a program over ``count`` variables."""
    rows = count + len(blocks) * moves
    hessian = np.zeros((count, count))
    gradient = np.zeros(count)
    x = np.zeros(count)
    return QuadraticProgram(moves, blocks, hessian, gradient, -np.ones(rows), np.ones(rows), x)


class ProgramSolver:
    """OSQP for one program: set up once, updated in each call, begun with the last multipliers.

    Stellato, Banjac, Goulart, Bemporad and Boyd, Math. Program. Comput. 12(4), 2020.

    Args:
        program: the memory that it reads and writes.
        tolerance: absolute and relative.
        iterations: after which it gives up.
    """

    def __init__(self, program: QuadraticProgram, tolerance: float, iterations: int) -> None:
        self._program = program
        n = len(program.x)
        rows = np.eye(len(program.low), n)
        moves = program.moves
        for b, first in enumerate(program.blocks):
            change = np.eye(moves) - np.eye(moves, k=-1)
            rows[n + b * moves : n + (b + 1) * moves, first : first + moves] = change
        self._columns, self._rows = np.tril_indices(n)  # of the upper half, column by column
        pattern = csc_matrix((np.ones(len(self._rows)), (self._rows, self._columns)), shape=(n, n))
        self._solver = osqp.OSQP()
        self._solver.setup(
            pattern,
            program.gradient,
            csc_matrix(rows),
            program.low,
            program.high,
            eps_abs=tolerance,
            eps_rel=tolerance,
            max_iter=iterations,
            **_SETTINGS,
        )

    def solve(self) -> bool:
        """Minimise from ``x``, in place; False if OSQP does not call its answer solved."""
        program = self._program
        trace = float(np.trace(program.hessian))
        finite = np.isfinite(program.hessian).all() and np.isfinite(program.gradient).all()
        if not (finite and trace > 0.0):
            return False
        scale = len(program.x) / trace  # so that one step size suits any horizon
        self._solver.update(
            q=scale * program.gradient,
            l=program.low,
            u=program.high,
            Px=scale * program.hessian[self._rows, self._columns],
        )
        self._solver.warm_start(x=program.x)
        found = self._solver.solve(raise_error=False)
        if found.info.status_val in _NO_POINT:
            self._solver.warm_start(y=np.zeros(len(program.low)))
        if found.info.status_val != _SOLVED:
            return False
        program.x[:] = found.x
        return True
