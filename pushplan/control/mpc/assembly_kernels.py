"""Compiled assembly of the tracking problem: from a path and a nominal motion to P and q.

The robot's motion under a constant twist is an exact arc, so the prediction has no discretisation
error. Offset and heading error are linearised about a nominal motion (the last solution, moved on
in time), which is a Gauss-Newton step of the nonlinear problem: the real-time iteration of Diehl,
Bock and Schlöder (SIAM J. Control Optim. 43(5), 2005). The states are eliminated, which leaves a
problem in the inputs alone whose constraints never change and can always be met.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.control.mpc.tracking_kernels import ReferencePath, Tuning, arc, errors, locate
from pushplan.world.checks import FloatArray


class AssemblyMemory(NamedTuple):
    """Memory for an assembly over n variables."""

    jacobian: FloatArray  # (3, n) d(x, y, theta)/dz
    rows: FloatArray  # (2, n) d(offset, heading error)/dz
    motion: FloatArray  # (9,) as `arc` fills it
    here: FloatArray  # (3,)


def assembly_memory(count: int) -> AssemblyMemory:
    """Memory for ``count`` variables."""
    return AssemblyMemory(np.zeros((3, count)), np.zeros((2, count)), np.zeros(9), np.zeros(3))


@kernel
def _speed_at(track: ReferencePath, along: float, index: int, tuning: Tuning, dt: float) -> float:
    """Speed [m/s] that the plan has at a place, and that still allows to stop at its end."""
    speed: float = min(track.speeds[index], tuning.max_speed)
    if tuning.stops:
        left = track.lengths[-1] - along
        if left <= 1e-9:
            return 0.0
        speed = min(speed, left / dt, np.sqrt(2.0 * tuning.max_acceleration * left))
    return speed


@kernel
def assemble(
    track: ReferencePath,
    tuning: Tuning,
    pose: FloatArray,  # (3,) where the robot is when the first command takes effect
    along: float,  # path length of its place on the path [m]
    twist: FloatArray,  # (2,) speed [m/s] and turn rate [rad/s] of the command before the first
    steps: FloatArray,  # (N,) how long each command is held [s]
    nominal: FloatArray,  # (N, 2) to linearise about; NaN is filled with what the path asks for
    hessian: FloatArray,  # (n, n) P; n = N, or 2 N where the speed is optimised
    gradient: FloatArray,  # (n,) q
    memory: AssemblyMemory,
) -> None:
    """Fill P and q of min 1/2 zᵀPz + qᵀz over z = (w_0 .. w_N-1 [, v_0 .. v_N-1]), as fractions."""
    count = steps.shape[0]
    n = gradient.shape[0]
    hessian[:] = 0.0
    gradient[:] = 0.0
    jacobian, rows, out, here = memory
    jacobian[:] = 0.0
    copy_into(here, pose)
    place = along
    speed = twist[0]
    unit = tuning.size / tuning.max_speed  # T [s]
    _, index, fraction = locate(track, here[0], here[1], place, place)
    curvature = errors(track, here[0], here[1], here[2], index, fraction)[3]
    for k in range(count):
        dt = steps[k]
        tau = dt / unit
        wanted = _speed_at(track, place, index, tuning, dt)
        if not (tuning.optimise_speed and np.isfinite(nominal[k, 0])):
            reach = tuning.max_acceleration * dt
            nominal[k, 0] = min(max(wanted, speed - reach), speed + reach)
        speed = nominal[k, 0]
        turning = min(max(speed * curvature, -tuning.max_turn_rate), tuning.max_turn_rate)
        if not np.isfinite(nominal[k, 1]):
            nominal[k, 1] = turning
        arc(here[0], here[1], here[2], speed, nominal[k, 1], dt, out)
        _differentiate(jacobian, k, count, out, dt, tuning)
        here[0] = out[0]
        here[1] = out[1]
        here[2] = out[2]
        place, index, fraction = locate(track, here[0], here[1], place, place + 2.0 * speed * dt)
        offset, error, heading, curvature = errors(
            track, here[0], here[1], here[2], index, fraction
        )
        c = np.cos(heading)
        s = np.sin(heading)
        away = 1.0 - curvature * offset
        for j in range(n):
            ahead = c * jacobian[0, j] + s * jacobian[1, j]
            rows[0, j] = (c * jacobian[1, j] - s * jacobian[0, j]) / tuning.size
            rows[1, j] = jacobian[2, j] - curvature * ahead / max(away, 0.2)
        factor = tau * (tuning.terminal if k == count - 1 else 1.0)
        _add(hessian, gradient, rows[0], offset / tuning.size, nominal, tuning, factor)
        _add(hessian, gradient, rows[1], error, nominal, tuning, factor * tuning.heading_weight)
        asked = (wanted / tuning.max_speed, turning / tuning.max_turn_rate)
        before = twist[1] / tuning.max_turn_rate
        _add_input_costs(hessian, gradient, k, count, asked, before, tau, tuning)
    for j in range(n):
        for i in range(j):
            hessian[i, j] = hessian[j, i]


@kernel
def _differentiate(
    jacobian: FloatArray, k: int, count: int, motion: FloatArray, dt: float, tuning: Tuning
) -> None:
    """Carry d(x, y, theta)/dz over the step ``k``, whose `arc` is ``motion``."""
    for j in range(jacobian.shape[1]):
        jacobian[0, j] -= motion[4] * jacobian[2, j]
        jacobian[1, j] += motion[3] * jacobian[2, j]
    jacobian[0, k] += motion[5] * tuning.max_turn_rate
    jacobian[1, k] += motion[6] * tuning.max_turn_rate
    jacobian[2, k] += dt * tuning.max_turn_rate
    if tuning.optimise_speed:
        jacobian[0, count + k] += motion[7] * tuning.max_speed
        jacobian[1, count + k] += motion[8] * tuning.max_speed


@kernel
def _add_input_costs(
    hessian: FloatArray,
    gradient: FloatArray,
    k: int,
    count: int,
    asked: tuple[float, float],  # speed and turn rate of the path, in the units of the problem
    before: float,  # turn rate of the command before the first
    tau: float,  # length of the step [T]
    tuning: Tuning,
) -> None:
    """Add the cost of the inputs of step ``k``: departing from what is asked, changing the turn."""
    scale = (tuning.max_turn_rate * tuning.size / tuning.max_speed) ** 2
    _diagonal(hessian, gradient, k, asked[1], tau * tuning.turn_weight * scale)
    if tuning.optimise_speed:
        _diagonal(hessian, gradient, count + k, asked[0], tau * tuning.speed_weight)
    smoothness = tuning.smoothness * scale / tau
    hessian[k, k] += smoothness
    if k == 0:
        gradient[0] -= smoothness * before
    else:
        hessian[k - 1, k - 1] += smoothness
        hessian[k, k - 1] -= smoothness


@kernel
def _add(
    hessian: FloatArray,
    gradient: FloatArray,
    row: FloatArray,
    value: float,
    nominal: FloatArray,
    tuning: Tuning,
    weight: float,
) -> None:
    """Add weight/2 (value + row (z - z_nominal))² to the cost, to the lower half of P."""
    count = nominal.shape[0]
    n = row.shape[0]
    for j in range(n):  # later inputs have no influence, and may not be known yet
        if row[j] != 0.0:
            if j < count:
                input_now = nominal[j, 1] / tuning.max_turn_rate
            else:
                input_now = nominal[j - count, 0] / tuning.max_speed
            value -= row[j] * input_now
    for j in range(n):
        if row[j] == 0.0:
            continue
        part = weight * row[j]
        target = hessian[j]
        gradient[j] += part * value
        for i in range(j + 1):
            target[i] += part * row[i]


@kernel
def _diagonal(
    hessian: FloatArray, gradient: FloatArray, k: int, wanted: float, weight: float
) -> None:
    """Add weight/2 (z_k - wanted)² to the cost."""
    hessian[k, k] += weight
    gradient[k] -= weight * wanted
