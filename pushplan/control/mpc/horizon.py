"""What predictive controllers share: track, time grid, bounds, programs about the last solution."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pushplan.compiled import kernel
from pushplan.control.mpc.kernels import Track
from pushplan.control.mpc.solver import QuadraticProgram
from pushplan.world import Plan, RobotModel
from pushplan.world.checks import FloatArray, IntArray


def track_of(plan: Plan) -> Track:
    """The path of a plan as the kernels read it."""
    return Track(plan.poses, plan.arc_lengths, plan.speeds)


def time_grid(count: int, span: float, held: float) -> FloatArray:
    """(N,) how long each step is [s]: the first until the next call, the others a part of a span.

    Args:
        count: N.
        span: of all steps [s].
        held: time between two calls [s]; no step is shorter.
    """
    steps = np.full(count, max(held, span / count))
    steps[0] = held
    return steps


@kernel(allocates=True)
def shifted_index(old: FloatArray, new: FloatArray, held: float) -> IntArray:
    """(N,) the old step that each new one lies in, ``held`` [s] later, N past the end."""
    ends, middles = np.cumsum(old) - held, np.cumsum(new) - 0.5 * new
    return np.searchsorted(ends, middles)


class RecedingHorizon:
    """Commands for the next steps from quadratic programs about the last solution.

    Args:
        robot: its limits.
        columns: the variables in their order: 0 speed, 1 turn rate.
        moves: M, commands of each.
        tolerance: of the solver, absolute and relative.
        iterations: after which the solver gives up.
    """

    def __init__(
        self,
        robot: RobotModel,
        columns: Sequence[int],
        moves: int,
        *,
        tolerance: float,
        iterations: int,
    ) -> None:
        self.units = np.array([robot.max_speed, robot.max_turn_rate])
        """Of speed [m/s] and turn rate [rad/s] in the program."""
        self._limits = np.array([robot.max_acceleration, robot.max_turn_acceleration]) / self.units
        self._columns = list(columns)
        limited = tuple(math.isfinite(self._limits[column]) for column in columns)
        self._program = QuadraticProgram(
            len(columns), moves, limited, tolerance=tolerance, iterations=iterations
        )
        self.count = self._program.count
        """Number of variables."""
        self.changes = self._program.rows - self.count
        """Number of constraints on changes of commands."""

    def bounds(self, spans: FloatArray, last: Sequence[float]) -> tuple[FloatArray, FloatArray]:
        """Bounds of the commands, ±1, and of their changes, in the units of the program.

        Args:
            spans: (M,) time in which each command may change [s].
            last: speed [m/s] and turn rate [rad/s] before the first.
        """
        low, high = -np.ones(self._program.rows), np.ones(self._program.rows)
        row, count = self.count, len(spans)
        for column in self._columns:
            if math.isfinite(self._limits[column]):
                reach = self._limits[column] * spans
                low[row : row + count], high[row : row + count] = -reach, reach
                low[row] += last[column] / self.units[column]
                high[row] += last[column] / self.units[column]
                row += count
        return low, high

    def solve(
        self,
        nominal: FloatArray,
        low: FloatArray,
        high: FloatArray,
        rounds: int,
        assemble: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    ) -> FloatArray | None:
        """(M, 2) speeds [m/s] and turn rates [rad/s]; None where the solver has no solution.

        Args:
            nominal: (M, 2) to begin with; changed in place.
            low: lower bounds, see `bounds`.
            high: upper bounds.
            rounds: programs that are solved, each about the solution of the one before.
            assemble: from nominal commands to P and q of the program.
        """
        columns = self._columns
        for _ in range(rounds):
            hessian, gradient = assemble(nominal)
            start = np.ascontiguousarray((nominal / self.units)[:, columns].T.ravel())
            found = self._program.solve(hessian, gradient, low, high, start)
            if found is None:
                return None
            nominal[:, columns] = found.reshape(len(columns), -1).T * self.units[columns]
        return nominal
