"""Track, time grid, bounds and programs about the last solution, for predictive controllers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pushplan.control.mpc.quadratic_program import (
    ProgramSolver,
    QuadraticProgram,
    quadratic_program,
)
from pushplan.core import control
from pushplan.world import Drive, Plan, RobotModel
from pushplan.world.checks import FloatArray, IntArray

_SENT = 256  # commands under way that are remembered; of more than these the oldest count no more
_KNOWN = 1  # place of `Horizon.counts` that is 1 if there is a solution
_FAILED = 3  # place of how often the solver has failed


class Horizon(NamedTuple):
    """Commands for the next steps, from quadratic programs about the last solution.

    The core has them all; the arrays are those that the solver's side shares.
    """

    core: control.Horizon
    units: FloatArray  # (2,) of speed [m/s] and turn rate [rad/s] in the program
    columns: IntArray  # (C,) what each block of variables is: 0 speed, 1 turn rate
    program: QuadraticProgram  # Over M commands of each, in units
    steps: FloatArray  # (N,) how long each step is [s]
    nominal: FloatArray  # (M, 2) what the next program is about
    last: FloatArray  # (2,) the command before the first
    counts: IntArray  # (4,) see `_KNOWN` and `_FAILED`

    @property
    def failures(self) -> int:
        """Number of programs without a solution."""
        return int(self.counts[_FAILED])


def track_of(plan: Plan) -> control.ReferencePath:
    """The path of a plan as the core reads it."""
    return control.ReferencePath(plan.poses, plan.arc_lengths, plan.speeds)


def make_horizon(robot: RobotModel, columns: Sequence[int], count: int, moves: int) -> Horizon:
    """Memory for commands to a robot.

    Args:
        robot: its limits.
        columns: the variables in their order: 0 speed, 1 turn rate.
        count: N, steps.
        moves: M, commands of each variable.
    """
    rates = (robot.max_acceleration, robot.max_turn_acceleration)
    limited = [math.isfinite(rates[column]) for column in columns]
    blocks = np.flatnonzero(limited).astype(np.int64) * moves
    limits = control.CommandLimits(
        robot.drive is Drive.CONSTANT_SPEED,
        robot.min_speed,
        robot.max_speed,
        robot.max_turn_rate,
        *rates,
        robot.min_turning_radius,
    )
    units = np.array([robot.max_speed, robot.max_turn_rate])
    kinds = np.array(columns, dtype=np.int64)
    program = quadratic_program(len(columns) * moves, moves, blocks)
    steps = np.zeros(count)
    nominal = np.zeros((moves, 2))
    last = np.zeros(2)
    counts = np.zeros(4, dtype=np.int64)
    made = control.Horizon(
        limits,
        units,
        kinds,
        *program,
        steps,
        solved=np.zeros(count),
        shifted=np.zeros(count, dtype=np.int64),
        solution=np.zeros((moves, 2)),
        nominal=nominal,
        last=last,
        sent=np.zeros((_SENT, 3)),
        counts=counts,
    )
    return Horizon(made, units, kinds, program, steps, nominal, last, counts)


def solve_rounds(
    horizon: Horizon,
    solver: ProgramSolver,
    rounds: int,
    first_rounds: int,
    assemble: Callable[[], object],
) -> bool:
    """Make the nominal commands a solution; False if the solver does not find one.

    Args:
        horizon: its memory, with the program put up about the nominal commands.
        solver: of that program.
        rounds: how many programs are solved.
        first_rounds: the same where there is no solution yet.
        assemble: puts the program up about the commands that the one before has given.
    """
    known = horizon.counts[_KNOWN] == 1
    for i in range(rounds if known else first_rounds):
        if i:
            assemble()
        if not _solve_about(horizon, solver):
            return False
    return True


def _solve_about(horizon: Horizon, solver: ProgramSolver) -> bool:
    """Solve the program from the nominal commands, and replace them; False if it is not solved."""
    moves = horizon.program.moves
    columns = horizon.columns
    nominal = horizon.nominal[:, columns]
    horizon.program.x[:] = (nominal / horizon.units[columns]).T.ravel()
    if not solver.solve():
        return False
    horizon.nominal[:, columns] = horizon.program.x.reshape(-1, moves).T * horizon.units[columns]
    return True
