"""Track, time grid, bounds and programs about the last solution, for predictive controllers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel, owned
from pushplan.control.mpc.quadratic_program import (
    ProgramSolver,
    QuadraticProgram,
    quadratic_program,
)
from pushplan.control.mpc.tracking_kernels import ReferencePath
from pushplan.world import Drive, Plan, RobotModel
from pushplan.world.checks import FloatArray, IntArray

SENT = 256
"""Commands under way that are remembered; of more than these the oldest count no more."""


class CommandLimits(NamedTuple):
    """Speed, turn-rate and acceleration limits of a robot."""

    constant: bool  # True if it always drives at max_speed
    min_speed: float
    max_speed: float
    max_turn_rate: float
    max_acceleration: float
    max_turn_acceleration: float
    turning_radius: float  # That a car has at any speed [m]; 0 for other drives


class Horizon(NamedTuple):
    """Commands for the next steps, from quadratic programs about the last solution."""

    limits: CommandLimits
    units: FloatArray  # (2,) of speed [m/s] and turn rate [rad/s] in the program
    columns: IntArray  # (C,) what each block of variables is: 0 speed, 1 turn rate
    program: QuadraticProgram  # Over M commands of each, in units
    steps: FloatArray  # (N,) how long each step is [s]
    solved: FloatArray  # (N,) the same when the last solution was found
    shifted: IntArray  # (N,) the step of then that each one lies in; N past the end
    solution: FloatArray  # (M, 2) speeds [m/s] and turn rates [rad/s]
    nominal: FloatArray  # (M, 2) what the next program is about
    last: FloatArray  # (2,) the command before the first
    sent: FloatArray  # (SENT, 3) time [s], speed and turn rate of commands under way
    counts: IntArray  # (4,) commands under way, 1 if there is a solution, failures since, and ever


UNDER_WAY, KNOWN, MISSED, FAILED = range(4)
"""Places in `Horizon.counts`."""


def track_of(plan: Plan) -> ReferencePath:
    """The path of a plan as the kernels read it."""
    return ReferencePath(owned(plan.poses), owned(plan.arc_lengths), owned(plan.speeds))


def limits_of(robot: RobotModel) -> CommandLimits:
    """The limits of a robot as the kernels read them."""
    return CommandLimits(
        robot.drive is Drive.CONSTANT_SPEED,
        robot.min_speed,
        robot.max_speed,
        robot.max_turn_rate,
        robot.max_acceleration,
        robot.max_turn_acceleration,
        robot.min_turning_radius,
    )


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
    return Horizon(
        limits_of(robot),
        np.array([robot.max_speed, robot.max_turn_rate]),
        np.array(columns, dtype=np.int64),
        quadratic_program(len(columns) * moves, moves, blocks),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count, dtype=np.int64),
        np.zeros((moves, 2)),
        np.zeros((moves, 2)),
        np.zeros(2),
        np.zeros((SENT, 3)),
        np.zeros(4, dtype=np.int64),
    )


@kernel
def lay_steps(horizon: Horizon, span: float, held: float) -> None:
    """Set the steps: the first until the next call, ``held``, the others a part of ``span`` [s]."""
    count = horizon.steps.shape[0]
    for k in range(count):
        horizon.steps[k] = held if k == 0 else max(held, span / count)


@kernel
def shift_steps(horizon: Horizon, held: float) -> None:
    """Set which step of the last solution each one lies in, ``held`` [s] later."""
    old = horizon.solved
    new = horizon.steps
    count = horizon.steps.shape[0]
    index = 0
    end = old[0]
    begin = 0.0
    for k in range(count):
        middle = begin + new[k] - 0.5 * new[k]
        while index < count and end - held < middle:
            index += 1
            if index < count:
                end += old[index]
        horizon.shifted[k] = index
        begin += new[k]


@kernel
def set_bounds(horizon: Horizon, first: float, later: float) -> None:
    """Bound the commands, ±1, and by what they change in times [s], in the program's units."""
    program = horizon.program
    limits = horizon.limits
    units = horizon.units
    n = program.x.shape[0]
    moves = program.moves
    for i in range(n):
        program.low[i] = -1.0
        program.high[i] = 1.0
    for b in range(program.blocks.shape[0]):
        kind = horizon.columns[program.blocks[b] // moves]
        row = n + b * moves
        rate = limits.max_acceleration if kind == 0 else limits.max_turn_acceleration
        for i in range(moves):
            reach = rate / units[kind] * (first if i == 0 else later)
            before = horizon.last[kind] / units[kind] if i == 0 else 0.0
            program.low[row + i] = before - reach
            program.high[row + i] = before + reach


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
    known = horizon.counts[KNOWN] == 1
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


@kernel
def keep_solution(horizon: Horizon) -> None:
    """Keep the nominal commands as the solution for the present steps."""
    horizon.counts[KNOWN] = 1
    copy_into(horizon.solution, horizon.nominal)
    copy_into(horizon.solved, horizon.steps)


@kernel
def send(horizon: Horizon, v: float, w: float, held: float, ramps: bool, out: FloatArray) -> None:
    """Fill the nearest command within the limits, and remember it as the last.

    Args:
        horizon: its memory.
        v: wanted speed [m/s].
        w: wanted turn rate [rad/s].
        held: time for which it is held [s].
        ramps: keep within the accelerations too.
        out: (2,) speed and turn rate.
    """
    limits = horizon.limits
    last = horizon.last
    if ramps:
        dv = limits.max_acceleration * held
        dw = limits.max_turn_acceleration * held
        v = min(max(v, last[0] - dv), last[0] + dv)
        w = min(max(w, last[1] - dw), last[1] + dw)
    if limits.constant:
        v = limits.max_speed
    out[0] = min(max(v, limits.min_speed), limits.max_speed)
    most = limits.max_turn_rate
    if limits.turning_radius > 0.0:
        most = min(most, abs(out[0]) / limits.turning_radius)
    out[1] = min(max(w, -most), most)
    last[0] = out[0]
    last[1] = out[1]


@kernel
def remember(horizon: Horizon, time: float, over: float) -> None:
    """Add the last command, sent at ``time``, and drop those that another followed by ``over``."""
    sent = horizon.sent
    count = horizon.counts[UNDER_WAY]
    drop = 0
    while drop < count and (count - drop >= sent.shape[0] or _followed(sent, count, drop, over)):
        drop += 1
    for i in range(drop, count):
        for j in range(3):
            sent[i - drop, j] = sent[i, j]
    count -= drop
    sent[count, 0] = time
    sent[count, 1] = horizon.last[0]
    sent[count, 2] = horizon.last[1]
    horizon.counts[UNDER_WAY] = count + 1


@kernel
def _followed(sent: FloatArray, count: int, i: int, over: float) -> bool:
    """Return True if the command after one was sent by ``over`` [s]; never so for the last."""
    return i + 1 < count and sent[i + 1, 0] < over
