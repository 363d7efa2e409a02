"""Compiled assembly of the pushing problem: from a path and nominal commands to P and q.

A Gauss-Newton step of the nonlinear problem about the last solution: the real-time iteration of
Diehl, Bock and Schlöder (SIAM J. Control Optim. 43(5), 2005), as Hogan and Rodriguez (WAFR 2016)
and Tang et al. (arXiv 2309.14295) use model-predictive control for pushing. States are eliminated,
which leaves a problem in the commands alone whose constraints can always be met.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.control.mpc.tracking_kernels import arc, errors, locate
from pushplan.planners.pushing.box_motion_kernels import advance, advance_box
from pushplan.planners.pushing.contact_kernels import Contact, flush_angle, standoff
from pushplan.planners.pushing.cost_kernels import (
    ROWS,
    Memory,
    PushingProblem,
    Step,
    add_command_costs,
    differentiate,
    residuals,
)
from pushplan.world.checks import FloatArray

NEAR = 1e-4
"""Cost of departing from the nominal commands, as a fraction of P's mean diagonal: it bounds the
condition of P, and is nothing once the commands do not change any more."""


@kernel
def _relative(
    contact: Contact, s: float, angle: float, v: float, w: float, dt: float, work: FloatArray
) -> tuple[float, float]:
    """Offset and angle after a step that begins in contact. ``work`` is (12,) memory."""
    state = work[:6]
    out = work[6:]
    state[3] = s
    state[4] = angle
    state[5] = 0.0
    advance_box(contact, state, v, w, dt, out)
    return state[3], state[4]


@kernel
def linearise(
    contact: Contact,
    s: float,
    angle: float,
    v: float,
    w: float,
    dt: float,
    scales: FloatArray,  # (4,) of the differences
    slopes: FloatArray,  # (2, 4) filled
    work: FloatArray,  # (12,) memory
) -> None:
    """Fill d(offset, angle) after the step / d(offset, angle, v, w), by central differences."""
    # wide enough to see across the edge of the friction cone; of the speed from 0 on only
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


@kernel
def _propagate(
    rows: FloatArray,  # (5, 2 M) changed in place
    motion: FloatArray,  # (9,) as `arc` fills it
    slopes: FloatArray,  # (2, 4) as `linearise` fills it
    units: FloatArray,  # (2,) of speed and turn rate
    dt: float,
    g: int,
) -> None:
    """Carry the derivatives of x, y, theta, offset and angle over a step under command ``g``."""
    moves = rows.shape[1] // 2
    for j in range(rows.shape[1]):
        rows[0, j] -= motion[4] * rows[2, j]
        rows[1, j] += motion[3] * rows[2, j]
        s = rows[3, j]
        a = rows[4, j]
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


@kernel
def assemble(problem: PushingProblem, nominal: FloatArray, memory: Memory) -> float:
    """Fill P and q over z = (v_0 .. v_M-1, w_0 .. w_M-1) in ``units``; returns the nominal cost."""
    contact, track, weights, start, along, _, units, steps, groups = problem
    jacobian = memory.jacobian
    residual = memory.residual
    hessian = memory.hessian
    gradient = memory.gradient
    states = memory.states
    rows = memory.rows
    motion = memory.motion
    detail = memory.detail
    slopes = memory.slopes
    scales = memory.scales
    work = memory.work
    count = steps.shape[0]
    moves = nominal.shape[0]
    jacobian[:] = 0.0
    hessian[:] = 0.0
    gradient[:] = 0.0
    rows[:] = 0.0
    scales[0] = 0.01 * weights.half
    scales[1] = 0.02
    scales[2] = 0.05 * units[0]
    scales[3] = 0.02 * units[0] / weights.length
    here = states[0]
    copy_into(here, start)
    here[0] += start[5] * np.cos(start[2])  # as if the gap had closed already
    here[1] += start[5] * np.sin(start[2])
    here[5] = 0.0
    place = along
    value = 0.0
    unit = weights.length / weights.max_speed  # T [s]
    bx, by = _box(contact, here)
    _, index, fraction = locate(track, bx, by, place, place)
    curvature = errors(track, bx, by, here[2], index, fraction)[3]
    for k in range(count):
        dt = steps[k]
        g = groups[k]
        v = nominal[g, 0]
        w = nominal[g, 1]
        tau = dt / unit
        wanted = min(track.speeds[index], weights.max_speed)
        wanted = min(wanted, max(track.lengths[-1] - place, 0.0) / dt)
        asked_turn = min(max(wanted * curvature, -units[1]), units[1])
        linearise(contact, here[3], here[4], v, w, dt, scales, slopes, work)
        arc(here[0], here[1], here[2], v, w, dt, motion)
        _propagate(rows, motion, slopes, units, dt, g)
        here = states[k + 1]
        copy_into(here, states[k])
        advance(contact, here, v, w, dt, detail)
        here[5] = 0.0
        bx, by = _box(contact, here)
        place, index, fraction = locate(track, bx, by, place, place + 2.0 * v * dt + 1e-9)
        lateral, error, heading, curvature = errors(
            track, bx, by, here[2] + here[4], index, fraction
        )
        flush = flush_angle(contact, here[3])
        factor = tau * (weights.terminal if k == count - 1 else 1.0)
        block = residual[ROWS * k : ROWS * (k + 1)]
        residuals(weights, lateral, error, here, flush, v, w, factor, block)
        differentiate(
            contact, weights, here, heading, curvature, lateral, rows, factor, jacobian[ROWS * k :]
        )
        if block[5] != 0.0:
            sign = np.sqrt(factor * weights.grip) * weights.length / weights.max_speed
            jacobian[ROWS * k + 5, moves + g] = sign * units[1]
            slope = -weights.curvature if block[5] > 0.0 else weights.curvature
            jacobian[ROWS * k + 5, g] = sign * slope * units[0]
        step = Step(k, g, tau, wanted, asked_turn)
        value += add_command_costs(problem, step, nominal, memory)
    for r in range(residual.shape[0]):
        value += 0.5 * residual[r] * residual[r]
    _square(problem, nominal, memory)
    return value


@kernel
def _square(problem: PushingProblem, nominal: FloatArray, memory: Memory) -> None:
    """Add JᵀJ to P and Jᵀ(r - J z) to q by loops over what is not zero."""
    # a threaded matrix product waits longer than it computes
    jacobian = memory.jacobian
    residual = memory.residual
    hessian = memory.hessian
    gradient = memory.gradient
    product = memory.product
    pull = memory.pull
    z = memory.z
    row = memory.row
    units = problem.units
    groups = problem.groups
    moves = nominal.shape[0]
    n = gradient.shape[0]
    product[:] = 0.0  # in the order v_0, w_0, v_1, ..: no command after its step
    pull[:] = 0.0
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


@kernel
def _box(contact: Contact, state: FloatArray) -> tuple[float, float]:
    """The box's centre [m]."""
    x = standoff(contact, state[3], state[4])[0] + state[5]
    c = np.cos(state[2])
    s = np.sin(state[2])
    return state[0] + c * x - s * state[3], state[1] + s * x + c * state[3]
