"""Compiled assembly of the pushing problem: from a path and nominal commands to P and q.

A Gauss-Newton step of the nonlinear problem about the last solution: the real-time iteration of
Diehl, Bock and Schlöder (SIAM J. Control Optim. 43(5), 2005), as Hogan and Rodriguez (WAFR 2016)
and Tang et al. (arXiv 2309.14295) use model-predictive control for pushing. States are eliminated,
which leaves a problem in the commands alone whose constraints can always be met.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.control.mpc.kernels import Track, arc, errors, locate
from pushplan.planners.pushing.cost import ROWS, Weights, differentiate, price_commands, residuals
from pushplan.planners.pushing.kernels import Contact, advance, flush_angle, standoff
from pushplan.world.checks import FloatArray, IntArray

NEAR = 1e-4
"""Price of departing from the nominal commands, as a share of P's mean diagonal: it bounds the
condition of P, and is nothing once the commands do not change any more."""


@kernel(allocates=True)
def _relative(
    contact: Contact, s: float, angle: float, v: float, w: float, dt: float, work: FloatArray
) -> tuple[float, float]:
    """Offset and angle after a step that begins in contact. ``work`` is (12,) memory."""
    state, out = work[:6], work[6:]
    state[0] = state[1] = state[2] = state[5] = 0.0
    state[3], state[4] = s, angle
    advance(contact, state, v, w, dt, out)
    return state[3], state[4]


@kernel(allocates=True)
def linearise(
    contact: Contact,
    s: float,
    angle: float,
    v: float,
    w: float,
    dt: float,
    scales: FloatArray,
    slopes: FloatArray,
    work: FloatArray,
) -> None:
    """Fill ``slopes`` (2, 4): d(offset, angle) after the step / d(offset, angle, v, w).

    Central differences over ``scales`` (4,), wide enough to see across the edge of the friction
    cone; of the speed from 0 on only.
    """
    for j in range(4):
        h = scales[j]
        low = min(h, v) if j == 2 else h
        a = _relative(
            contact,
            s + (h if j == 0 else 0.0),
            angle + (h if j == 1 else 0.0),
            v + (h if j == 2 else 0.0),
            w + (h if j == 3 else 0.0),
            dt,
            work,
        )
        b = _relative(
            contact,
            s - (low if j == 0 else 0.0),
            angle - (low if j == 1 else 0.0),
            v - (low if j == 2 else 0.0),
            w - (low if j == 3 else 0.0),
            dt,
            work,
        )
        slopes[0, j] = (a[0] - b[0]) / (h + low)
        slopes[1, j] = (a[1] - b[1]) / (h + low)


@kernel(allocates=True)
def _propagate(
    rows: FloatArray,
    motion: FloatArray,
    slopes: FloatArray,
    units: FloatArray,
    dt: float,
    g: int,
) -> None:
    """Carry the derivatives ``rows`` (5, 2 M) of the state over a step under command ``g``.

    Args:
        rows: of x, y, theta, offset and angle; changed in place.
        motion: (9,) as `arc` fills it.
        slopes: (2, 4) as `linearise` fills it.
        units: (2,) of speed and turn rate.
        dt: [s].
        g: index of the command.
    """
    moves = rows.shape[1] // 2
    for j in range(rows.shape[1]):
        rows[0, j] -= motion[4] * rows[2, j]
        rows[1, j] += motion[3] * rows[2, j]
        s, a = rows[3, j], rows[4, j]
        rows[3, j] = slopes[0, 0] * s + slopes[0, 1] * a
        rows[4, j] = slopes[1, 0] * s + slopes[1, 1] * a
    rows[0, g] += motion[7] * units[0]
    rows[1, g] += motion[8] * units[0]
    rows[3, g] += slopes[0, 2] * units[0]
    rows[4, g] += slopes[1, 2] * units[0]
    rows[0, moves + g] += motion[5] * units[1]
    rows[1, moves + g] += motion[6] * units[1]
    rows[2, moves + g] += dt * units[1]
    rows[3, moves + g] += slopes[0, 3] * units[1]
    rows[4, moves + g] += slopes[1, 3] * units[1]


@kernel(allocates=True)
def assemble(
    contact: Contact,
    track: Track,
    weights: Weights,
    start: FloatArray,
    along: float,
    last: FloatArray,
    units: FloatArray,
    steps: FloatArray,
    groups: IntArray,
    nominal: FloatArray,
    jacobian: FloatArray,
    residual: FloatArray,
    hessian: FloatArray,
    gradient: FloatArray,
    states: FloatArray,
) -> float:
    """Fill P and q of min 1/2 zᵀPz + qᵀz over z = (v_0 .. v_M-1, w_0 .. w_M-1) in ``units``.

    Args:
        contact: bumper, face and friction.
        track: the box's path.
        weights: prices.
        start: (6,) state when the first command takes effect.
        along: path length of the box's place [m].
        last: (2,) the command before the first.
        units: (2,) of speed and turn rate.
        steps: (N,) [s].
        groups: (N,) which of the M commands holds in each step.
        nominal: (M, 2) commands to linearise about.
        jacobian: (6 N, 2 M) memory.
        residual: (6 N,) memory.
        hessian: (2 M, 2 M) receives P.
        gradient: (2 M,) receives q.
        states: (N + 1, 6) receives the nominal motion.

    Returns:
        The cost of the nominal commands.
    """
    count, moves = steps.shape[0], nominal.shape[0]
    n = 2 * moves
    jacobian[:] = 0.0
    hessian[:] = 0.0
    gradient[:] = 0.0
    rows = np.zeros((5, n))  # d(x, y, theta, offset, angle)/dz
    motion, detail, slopes, work = np.empty(9), np.empty(6), np.empty((2, 4)), np.empty(12)
    scales = np.array(
        [0.01 * weights.half, 0.02, 0.05 * units[0], 0.02 * units[0] / weights.length]
    )
    here = states[0]
    here[:] = start
    here[0] += start[5] * np.cos(start[2])  # as if the gap had closed already
    here[1] += start[5] * np.sin(start[2])
    here[5] = 0.0
    place, value = along, 0.0
    unit = weights.length / weights.max_speed  # T [s]
    bx, by = _box(contact, here)
    _, index, share = locate(track, bx, by, place, place)
    bend = errors(track, bx, by, here[2], index, share)[3]
    for k in range(count):
        dt, g = steps[k], groups[k]
        v, w = nominal[g, 0], nominal[g, 1]
        tau = dt / unit
        wanted = min(track.speeds[index], weights.max_speed)
        wanted = min(wanted, max(track.lengths[-1] - place, 0.0) / dt)
        asked_turn = min(max(wanted * bend, -units[1]), units[1])
        linearise(contact, here[3], here[4], v, w, dt, scales, slopes, work)
        arc(here[0], here[1], here[2], v, w, dt, motion)
        _propagate(rows, motion, slopes, units, dt, g)
        here = states[k + 1]
        here[:] = states[k]
        advance(contact, here, v, w, dt, detail)
        here[5] = 0.0
        bx, by = _box(contact, here)
        place, index, share = locate(track, bx, by, place, place + 2.0 * v * dt + 1e-9)
        lateral, error, heading, bend = errors(track, bx, by, here[2] + here[4], index, share)
        flush = flush_angle(contact, here[3])
        factor = tau * (weights.terminal if k == count - 1 else 1.0)
        block = residual[ROWS * k : ROWS * (k + 1)]
        residuals(weights, lateral, error, here, flush, v, w, factor, block)
        differentiate(
            contact, weights, here, heading, bend, lateral, rows, factor, jacobian[ROWS * k :]
        )
        if block[5] != 0.0:
            sign = np.sqrt(factor * weights.grip) * weights.length / weights.max_speed
            jacobian[ROWS * k + 5, moves + g] = sign * units[1]
            slope = -weights.curvature if block[5] > 0.0 else weights.curvature
            jacobian[ROWS * k + 5, g] = sign * slope * units[0]
        value += price_commands(
            weights,
            k,
            g,
            moves,
            wanted,
            asked_turn,
            tau,
            units,
            groups,
            nominal,
            last,
            hessian,
            gradient,
        )
    value += 0.5 * float(residual @ residual)
    _square(jacobian, residual, units, groups, nominal, hessian, gradient)
    return value


@kernel(allocates=True)
def _square(
    jacobian: FloatArray,
    residual: FloatArray,
    units: FloatArray,
    groups: IntArray,
    nominal: FloatArray,
    hessian: FloatArray,
    gradient: FloatArray,
) -> None:
    """Add JᵀJ to P and Jᵀ(r - J z) to q.

    By loops over what is not zero: a threaded matrix product waits longer than it computes.
    """
    moves, n = nominal.shape[0], gradient.shape[0]
    product = np.zeros((n, n))  # in the order v_0, w_0, v_1, ..: no command after its step
    pull, z, row = np.zeros(n), np.empty(n), np.empty(n)
    for i in range(n):
        z[i] = nominal[i // 2, i % 2] / units[i % 2]
    for r in range(residual.shape[0]):
        used = 2 * (groups[r // ROWS] + 1)
        left = residual[r]
        for i in range(used):
            row[i] = jacobian[r, i // 2 + moves * (i % 2)]
            left -= row[i] * z[i]
        for i in range(used):
            part = row[i]
            if part == 0.0:
                continue
            pull[i] += part * left
            target = product[i]
            for j in range(i + 1):
                target[j] += part * row[j]
    for i in range(n):
        a = i // 2 + moves * (i % 2)
        gradient[a] += pull[i]
        for j in range(i + 1):
            b = j // 2 + moves * (j % 2)
            hessian[a, b] += product[i, j]
            if i != j:
                hessian[b, a] += product[i, j]
    keep = 0.0
    for i in range(n):
        keep += NEAR * hessian[i, i] / n
    for i in range(n):
        a = i // 2 + moves * (i % 2)
        hessian[a, a] += keep
        gradient[a] -= keep * z[i]


@kernel(allocates=True)
def _box(contact: Contact, state: FloatArray) -> tuple[float, float]:
    x = standoff(contact, state[3], state[4])[0] + state[5]
    c, s = np.cos(state[2]), np.sin(state[2])
    return state[0] + c * x - s * state[3], state[1] + s * x + c * state[3]
