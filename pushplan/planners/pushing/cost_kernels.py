"""Compiled cost of the pushing problem: residuals of a step, their derivatives, command costs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.control.mpc.tracking_kernels import ReferencePath
from pushplan.planners.pushing.contact_kernels import Contact, flush_angle, standoff
from pushplan.world.checks import FloatArray, IntArray

ROWS = 6
"""Residuals of one step: distance, direction, offset, rim, angle, grip."""

SPEED_SMOOTHNESS = 0.1
"""Cost of a change of speed, against that of turn rate."""


class Weights(NamedTuple):
    """Costs and scales of the cost, see `PushingConfig`."""

    length: float  # L [m]
    max_speed: float
    half: float  # Half the bumper, as far as offsets may reach [m]
    curvature: float  # Greatest that is used without a cost [1/m]; negative where there is no limit
    heading: float
    offset: float
    rim: float
    safe: float
    angle: float
    grip: float
    turn: float
    speed: float
    smoothness: float
    terminal: float


class PushingProblem(NamedTuple):
    """The pushing problem of one call."""

    contact: Contact  # Bumper, face and friction
    track: ReferencePath  # The box's path
    weights: Weights
    start: FloatArray  # (6,) state when the first command takes effect
    along: float  # Path length of the box's place [m]
    last: FloatArray  # (2,) the command before the first
    units: FloatArray  # (2,) of speed [m/s] and turn rate [rad/s] in the program
    steps: FloatArray  # (N,) [s]
    groups: IntArray  # (N,) which of the M commands holds in each step


class Memory(NamedTuple):
    """Arrays that an assembly fills, and its scratch memory; n = 2 M."""

    jacobian: FloatArray  # (6 N, n)
    residual: FloatArray  # (6 N,)
    hessian: FloatArray  # (n, n) P
    gradient: FloatArray  # (n,) q
    states: FloatArray  # (N + 1, 6) the nominal motion
    rows: FloatArray  # (5, n) d(x, y, theta, offset, angle)/dz
    motion: FloatArray  # (9,)
    detail: FloatArray  # (6,)
    slopes: FloatArray  # (2, 4)
    scales: FloatArray  # (4,)
    work: FloatArray  # (12,)
    product: FloatArray  # (n, n)
    pull: FloatArray  # (n,)
    z: FloatArray  # (n,)
    row: FloatArray  # (n,)


def assembly_memory(count: int, hessian: FloatArray, gradient: FloatArray) -> Memory:
    """Memory for N steps that fills P (n, n) and q (n,)."""
    n = len(gradient)
    shapes = [(5, n), (9,), (6,), (2, 4), (4,), (12,), (n, n), (n,), (n,), (n,)]
    return Memory(
        np.zeros((ROWS * count, n)),
        np.zeros(ROWS * count),
        hessian,
        gradient,
        np.zeros((count + 1, 6)),
        *(np.zeros(shape) for shape in shapes),
    )


@kernel
def residuals(
    weights: Weights,
    lateral: float,  # distance of the box from its path, left positive [m]
    error: float,  # direction of the push against the path's [rad]
    state: FloatArray,  # (6,) after the step
    flush: float,  # angle at which the box would lie on the bumper [rad]
    v: float,
    w: float,
    factor: float,  # length of the step [T], times ``terminal`` at the end
    out: FloatArray,
) -> None:
    """The (6,) weighted residuals of one step, whose squares are its cost but for the commands."""
    root = np.sqrt(factor)
    fraction = state[3] / weights.half
    beyond = max(abs(fraction) - weights.safe, 0.0)
    out[0] = root * lateral / weights.length
    out[1] = root * np.sqrt(weights.heading) * error
    out[2] = root * np.sqrt(weights.offset) * fraction
    out[3] = root * np.sqrt(weights.rim) * (beyond if fraction > 0.0 else -beyond)
    out[4] = root * np.sqrt(weights.angle) * (state[4] - flush)
    out[5] = 0.0
    if weights.curvature >= 0.0:
        over = max(abs(w) - weights.curvature * v, 0.0) * weights.length / weights.max_speed
        out[5] = root * np.sqrt(weights.grip) * (over if w > 0.0 else -over)


@kernel
def differentiate(
    contact: Contact,
    weights: Weights,
    state: FloatArray,
    heading: float,
    curvature: float,
    lateral: float,
    rows: FloatArray,
    factor: float,
    out: FloatArray,
) -> None:
    """Derivatives of the first five residuals of a step into the first rows of ``out``."""
    s = state[3]
    angle = state[4]
    x = standoff(contact, s, angle)[0]
    hs = 0.01 * weights.half
    ha = 0.01
    x_s = (standoff(contact, s + hs, angle)[0] - standoff(contact, s - hs, angle)[0]) / (2.0 * hs)
    x_a = (standoff(contact, s, angle + ha)[0] - standoff(contact, s, angle - ha)[0]) / (2.0 * ha)
    # robot axes on the path's
    c = np.cos(state[2] - heading)
    n = np.sin(state[2] - heading)
    cp = np.cos(heading)
    sp = np.sin(heading)
    root = np.sqrt(factor)
    away = max(1.0 - curvature * lateral, 0.2)
    fraction = s / weights.half
    rim = np.sqrt(weights.rim) if abs(fraction) > weights.safe else 0.0
    slope = (flush_angle(contact, s + hs) - flush_angle(contact, s - hs)) / (2.0 * hs)
    for j in range(rows.shape[1]):
        dx = rows[0, j]
        dy = rows[1, j]
        dt = rows[2, j]
        ds = rows[3, j]
        da = rows[4, j]
        if dt == 0.0 and dx == 0.0 and dy == 0.0 and ds == 0.0:
            continue
        # in robot axes
        ahead = x_s * ds + x_a * da
        left = ds
        across = cp * dy - sp * dx + (c * x - n * s) * dt + n * ahead + c * left
        along = cp * dx + sp * dy - (n * x + c * s) * dt + c * ahead - n * left
        out[0, j] = root * across / weights.length
        out[1, j] = root * np.sqrt(weights.heading) * (dt + da - curvature * along / away)
        out[2, j] = root * np.sqrt(weights.offset) * ds / weights.half
        out[3, j] = root * rim * ds / weights.half
        out[4, j] = root * np.sqrt(weights.angle) * (da - slope * ds)


class Step(NamedTuple):
    """One step of the horizon."""

    k: int  # Its number
    g: int  # The command that holds in it
    tau: float  # Its length [T]
    wanted: float  # Speed that the path has there [m/s]
    turn: float  # Turn rate likewise [rad/s]


@kernel
def add_command_costs(
    problem: PushingProblem, step: Step, nominal: FloatArray, memory: Memory
) -> float:
    """Add the cost of a step's commands to P and q; returns what the nominal ones cost."""
    weights = problem.weights
    units = problem.units
    hessian = memory.hessian
    gradient = memory.gradient
    k = step.k
    g = step.g
    tau = step.tau
    moves = nominal.shape[0]
    value = 0.0
    rate = units[1] * weights.length / weights.max_speed
    first = k == 0 or problem.groups[k - 1] != g
    for kind in range(2):
        i = g + kind * moves
        z = nominal[g, kind] / units[kind]
        asked = (step.wanted if kind == 0 else step.turn) / units[kind]
        cost = tau * (weights.speed if kind == 0 else weights.turn * rate * rate)
        hessian[i, i] += cost
        gradient[i] -= cost * asked
        value += 0.5 * cost * (z - asked) ** 2
        if not first:
            continue
        change = SPEED_SMOOTHNESS if kind == 0 else rate * rate
        cost = weights.smoothness * change / max(tau, 0.05)
        before = (nominal[g - 1, kind] if g > 0 else problem.last[kind]) / units[kind]
        value += 0.5 * cost * (z - before) ** 2
        hessian[i, i] += cost
        if g == 0:
            gradient[i] -= cost * before
        else:
            hessian[i - 1, i - 1] += cost
            hessian[i - 1, i] -= cost
            hessian[i, i - 1] -= cost
    return value
