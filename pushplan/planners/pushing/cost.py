"""Compiled cost of the pushing problem: residuals of a step, their derivatives, command prices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.planners.pushing.kernels import Contact, flush_angle, standoff
from pushplan.world.checks import FloatArray, IntArray

ROWS = 6
"""Residuals of one step: distance, direction, offset, rim, angle, grip."""

SPEED_CALM = 0.1
"""Price of a change of speed, against that of turn rate."""


class Weights(NamedTuple):
    """Prices and scales of the cost, see `PushingConfig`."""

    length: float
    """L [m]"""
    max_speed: float
    half: float
    """Half the bumper, as far as offsets may reach [m]."""
    curvature: float
    """Greatest that is used without a price [1/m]; negative where there is no limit."""
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


@kernel(allocates=True)
def residuals(
    weights: Weights,
    lateral: float,
    error: float,
    state: FloatArray,
    flush: float,
    v: float,
    w: float,
    factor: float,
    out: FloatArray,
) -> None:
    """The (6,) weighted residuals of one step, whose squares are its cost but for the commands.

    Args:
        weights: prices.
        lateral: distance of the box from its path, left positive [m].
        error: direction of the push against the path's [rad].
        state: (6,) after the step.
        flush: angle at which the box would lie on the bumper [rad].
        v: speed in the step [m/s].
        w: turn rate [rad/s].
        factor: length of the step [T], times ``terminal`` at the end.
        out: receives them.
    """
    root = np.sqrt(factor)
    share = state[3] / weights.half
    beyond = max(abs(share) - weights.safe, 0.0)
    out[0] = root * lateral / weights.length
    out[1] = root * np.sqrt(weights.heading) * error
    out[2] = root * np.sqrt(weights.offset) * share
    out[3] = root * np.sqrt(weights.rim) * (beyond if share > 0.0 else -beyond)
    out[4] = root * np.sqrt(weights.angle) * (state[4] - flush)
    out[5] = 0.0
    if weights.curvature >= 0.0:
        over = max(abs(w) - weights.curvature * v, 0.0) * weights.length / weights.max_speed
        out[5] = root * np.sqrt(weights.grip) * (over if w > 0.0 else -over)


@kernel(allocates=True)
def differentiate(
    contact: Contact,
    weights: Weights,
    state: FloatArray,
    heading: float,
    bend: float,
    lateral: float,
    rows: FloatArray,
    factor: float,
    out: FloatArray,
) -> None:
    """Derivatives of the first five residuals of a step into the first rows of ``out``."""
    s, angle = state[3], state[4]
    x = standoff(contact, s, angle)[0]
    hs, ha = 0.01 * weights.half, 0.01
    x_s = (standoff(contact, s + hs, angle)[0] - standoff(contact, s - hs, angle)[0]) / (2.0 * hs)
    x_a = (standoff(contact, s, angle + ha)[0] - standoff(contact, s, angle - ha)[0]) / (2.0 * ha)
    c, n = np.cos(state[2] - heading), np.sin(state[2] - heading)  # robot axes on the path's
    cp, sp = np.cos(heading), np.sin(heading)
    root = np.sqrt(factor)
    away = max(1.0 - bend * lateral, 0.2)
    share = s / weights.half
    rim = np.sqrt(weights.rim) if abs(share) > weights.safe else 0.0
    slope = (flush_angle(contact, s + hs) - flush_angle(contact, s - hs)) / (2.0 * hs)
    for j in range(rows.shape[1]):
        dx, dy, dt, ds, da = rows[0, j], rows[1, j], rows[2, j], rows[3, j], rows[4, j]
        if dt == 0.0 and dx == 0.0 and dy == 0.0 and ds == 0.0:
            continue
        ahead, left = x_s * ds + x_a * da, ds  # in robot axes
        across = cp * dy - sp * dx + (c * x - n * s) * dt + n * ahead + c * left
        along = cp * dx + sp * dy - (n * x + c * s) * dt + c * ahead - n * left
        out[0, j] = root * across / weights.length
        out[1, j] = root * np.sqrt(weights.heading) * (dt + da - bend * along / away)
        out[2, j] = root * np.sqrt(weights.offset) * ds / weights.half
        out[3, j] = root * rim * ds / weights.half
        out[4, j] = root * np.sqrt(weights.angle) * (da - slope * ds)


@kernel(allocates=True)
def price_commands(
    weights: Weights,
    k: int,
    g: int,
    moves: int,
    wanted: float,
    turn: float,
    tau: float,
    units: FloatArray,
    groups: IntArray,
    nominal: FloatArray,
    last: FloatArray,
    hessian: FloatArray,
    gradient: FloatArray,
) -> float:
    """Price the commands of step ``k``; returns what the nominal ones cost."""
    value = 0.0
    rate = units[1] * weights.length / weights.max_speed
    asked = (wanted / units[0], turn / units[1])
    first = k == 0 or groups[k - 1] != g
    for kind in range(2):
        i = g + kind * moves
        z = nominal[g, kind] / units[kind]
        price = tau * (weights.speed if kind == 0 else weights.turn * rate * rate)
        hessian[i, i] += price
        gradient[i] -= price * asked[kind]
        value += 0.5 * price * (z - asked[kind]) ** 2
        if not first:
            continue
        calm = weights.smoothness * (SPEED_CALM if kind == 0 else rate * rate) / max(tau, 0.05)
        before = (nominal[g - 1, kind] if g > 0 else last[kind]) / units[kind]
        value += 0.5 * calm * (z - before) ** 2
        hessian[i, i] += calm
        if g == 0:
            gradient[i] -= calm * before
        else:
            hessian[i - 1, i - 1] += calm
            hessian[i - 1, i] -= calm
            hessian[i, i - 1] -= calm
    return value
