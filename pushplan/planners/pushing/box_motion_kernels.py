"""Compiled quasi-static motion of one box in front of a bumper, and its pose in the robot's frame.

Robot and box move by time stepping: the robot along an arc, the box with the velocity of
`contact_velocity`, in substeps that are short against the distance between them.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.planners.pushing.contact_kernels import (
    Contact,
    contact_velocity,
    flush_angle,
    standoff,
    standoff_turned,
)
from pushplan.world.checks import FloatArray

_SUBSTEP = 0.2
"""Greatest motion of the bumper in one substep [distance from the axle to the box's centre]."""
_SUBSTEPS = 6
FLUSH = 1e-9
"""Angle below which a box counts as lying on the bumper [rad]."""


@kernel
def _drive(state: FloatArray, v: float, w: float, dt: float) -> None:
    """Move the robot along an arc and leave the box where it is on the ground."""
    theta = state[2]
    turn = w * dt
    half = 0.5 * turn
    chord = v * dt * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    state[0] += chord * np.cos(theta + half)
    state[1] += chord * np.sin(theta + half)
    state[2] = theta + turn


@kernel
def _leave(
    contact: Contact, state: FloatArray, ahead: float, v: float, w: float, dt: float
) -> tuple[float, float, float]:
    """Offset, angle and gap when the robot has moved for ``dt`` and the box, at x ahead, stood."""
    turn = w * dt
    half = 0.5 * turn
    ch = np.cos(half)
    sh = np.sin(half)
    chord = v * dt * (sh / half if abs(half) > 1e-9 else 1.0)
    dx = ahead - chord * ch
    dy = state[3] - chord * sh
    c = ch * ch - sh * sh
    s = 2.0 * ch * sh
    offset = c * dy - s * dx
    angle = state[4] - turn
    return offset, angle, c * dx + s * dy - standoff(contact, offset, angle)[0]


@kernel
def _push(
    contact: Contact,
    state: FloatArray,
    c: float,
    s: float,
    v: float,
    w: float,
    dt: float,
    out: FloatArray,
) -> None:
    """One substep of a box that touches the bumper at an angle of known cosine and sine."""
    uy = w * contact_velocity(contact, state[3], state[4], c, s, v, w, dt, out)
    before = state[4] - flush_angle(contact, state[3])
    state[3] += dt * (out[0] * s + out[1] * c - uy)
    state[4] += dt * (out[2] - w)
    if contact.curvature >= 0.0 and abs(before) > FLUSH:
        flush = flush_angle(contact, state[3])
        if before * (state[4] - flush) < 0.0:
            state[4] = flush  # the other end touches before the step is over


@kernel
def advance(
    contact: Contact,
    state: FloatArray,  # (6,) robot pose, the box's offset, its face's angle, gap >= 0; changed
    v: float,
    w: float,
    dt: float,
    out: FloatArray,  # (6,) of the last substep; of mode `FREE` without contact
) -> None:
    """Move robot and box on by ``dt`` [s] under one command; ``out`` as in `contact_velocity`."""
    advance_box(contact, state, v, w, dt, out)
    _drive(state, v, w, dt)  # one arc, whatever the box does


@kernel
def advance_box(
    contact: Contact, state: FloatArray, v: float, w: float, dt: float, out: FloatArray
) -> None:
    """`advance` of the box in the robot's frame alone: offset, angle and gap."""
    reach = contact.front + contact.depth
    travel = abs(v) * dt + abs(w) * dt * reach
    count = max(1, min(_SUBSTEPS, int(np.ceil(travel / (_SUBSTEP * reach)))))
    step = dt / count
    out[:] = 0.0
    for _ in range(count):
        gap = max(state[5], 0.0)
        c = np.cos(state[4])
        s = np.sin(state[4])
        ahead = standoff_turned(contact, state[3], c, s)[0] + gap
        left = _leave(contact, state, ahead, v, w, step)
        if left[2] >= 1e-9:
            state[3], state[4], state[5] = left
            out[:] = 0.0
            continue
        fraction = gap / (gap - left[2]) if gap > 1e-9 and gap > left[2] else 0.0
        if fraction > 0.0:
            state[3], state[4], _ = _leave(contact, state, ahead, v, w, fraction * step)
            c = np.cos(state[4])
            s = np.sin(state[4])
        state[5] = 0.0
        if fraction < 1.0:
            _push(contact, state, c, s, v, w, (1.0 - fraction) * step, out)


@kernel
def rollout(
    contact: Contact,
    state: FloatArray,
    twists: FloatArray,
    steps: FloatArray,
    states: FloatArray,
    details: FloatArray,
) -> None:
    """States (N + 1, 6) and details (N, 6) under twists (N, 2) held for steps (N,) [s]."""
    copy_into(states[0], state)
    for k in range(steps.shape[0]):
        copy_into(states[k + 1], states[k])
        advance(contact, states[k + 1], twists[k, 0], twists[k, 1], steps[k], details[k])


@kernel
def observe(
    contact: Contact, normal: float, robot: FloatArray, box: FloatArray, out: FloatArray
) -> None:
    """State (6,) of poses (3,) with the face's normal [rad]; the gap is negative in overlap."""
    dx = box[0] - robot[0]
    dy = box[1] - robot[1]
    c = np.cos(robot[2])
    s = np.sin(robot[2])
    out[0] = robot[0]
    out[1] = robot[1]
    out[2] = robot[2]
    out[3] = c * dy - s * dx
    out[4] = wrap_angle(box[2] + normal - robot[2])
    out[5] = c * dx + s * dy - standoff(contact, out[3], out[4])[0]


@kernel
def box_pose(contact: Contact, state: FloatArray, out: FloatArray) -> None:
    """x, y [m] of the box's centre and direction [rad] of the pushed face's normal, world."""
    x = standoff(contact, state[3], state[4])[0] + state[5]
    c = np.cos(state[2])
    s = np.sin(state[2])
    out[0] = state[0] + c * x - s * state[3]
    out[1] = state[1] + s * x + c * state[3]
    out[2] = state[2] + state[4]
