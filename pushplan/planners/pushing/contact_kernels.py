"""Compiled contact of a bumper and one box: where they touch, and how fast the box moves.

All velocities are in the frame of the pushed face: n forward, into the box, t to the left. The
ellipsoidal limit surface makes the box's velocity (v_n, v_t, ω) parallel to (f_n, f_t, τ/c²)
(Goyal, Ruina and Papadopoulos, Wear 143, 1991; Howe and Cutkosky, IJRR 15(6), 1996). A pressed line
of contact is a force at its centre of pressure y within the line, so τ = -a f_t - y f_n (Lynch and
Mason, IJRR 15(6), 1996). What would close or hold the line of contact within a step happens if
friction and pressure allow it, else the nearest that they allow.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray

FREE, STICK, SLIDE, CORNER_STICK, CORNER_SLIDE = range(5)


class Contact(NamedTuple):
    """Bumper and pushed face, as the kernels read them."""

    front: float  # x of the bumper in its middle, from the axle [m]
    half: float  # Half the bumper's width [m]
    curvature: float  # Curvature of the bumper's front [1/m]; positive where its ends reach ahead
    depth: float  # a: from the pushed face to the box's centre [m]
    low: float  # Right end of the face from the centre, along t [m], negative
    high: float  # Left end of the face [m]
    spread: float  # c = greatest torque / greatest force of the ground [m]
    friction: float  # Between bumper and box


@kernel
def line(contact: Contact, offset: float) -> tuple[float, float]:
    """The part of the face that is in front of the bumper, along t [m]; empty if low >= high."""
    low = max(contact.low, -contact.half - offset)
    high = min(contact.high, contact.half - offset)
    return low, high


@kernel
def flush_angle(contact: Contact, offset: float) -> float:
    """Angle of the face against the robot's heading when it lies on the bumper [rad]."""
    low, high = line(contact, offset)
    curvature = contact.curvature
    if curvature <= 0.0 or low >= high:
        return 0.0
    return -curvature * (offset + 0.5 * (low + high)) / (1.0 - curvature * contact.depth)


@kernel
def standoff(contact: Contact, offset: float, angle: float) -> tuple[float, float]:
    """X of the box's centre when it touches the bumper [m], and where it does, along t [m]."""
    return standoff_turned(contact, offset, np.cos(angle), np.sin(angle))


@kernel
def standoff_turned(contact: Contact, offset: float, c: float, s: float) -> tuple[float, float]:
    """`standoff` of an angle whose cosine and sine are known."""
    low, high = line(contact, offset)
    if low >= high:
        low = high = min(max(0.0, contact.low), contact.high)
    best = -np.inf
    at = 0.0
    middle = 0.5 * (low + high)
    if contact.curvature < 0.0 and c > 1e-3:
        middle = (-s / (c * contact.curvature) - offset + contact.depth * s) / c
        middle = min(max(middle, low), high)
    for y in (low, middle, high):
        lateral = offset - contact.depth * s + y * c
        x = contact.front + 0.5 * contact.curvature * lateral * lateral + contact.depth * c + y * s
        if x > best + 1e-12:
            best = x
            at = y
    return best, at


@kernel
def _corner(
    contact: Contact, y: float, tilt: float, un: float, ut: float, w: float, out: FloatArray
) -> None:
    """The box pushed at one point (-a, y) whose normal has an angle ``tilt`` in the face frame."""
    px = -contact.depth
    square = contact.spread * contact.spread
    # velocity of the bumper at the point
    cn = un - w * y
    ct = ut + w * px
    total = square + px * px + y * y
    vn = ((square + px * px) * cn + px * y * ct) / total
    vt = (px * y * cn + (square + y * y) * ct) / total
    nx = np.cos(tilt)
    ny = np.sin(tilt)
    press = vn * nx + vt * ny
    shear = vt * nx - vn * ny
    out[3] = y
    if cn * nx + ct * ny <= 0.0:
        out[0] = out[1] = out[2] = 0.0
        out[4] = float(FREE)
        out[5] = 0.0
        return
    if press > 0.0 and abs(shear) <= contact.friction * press:
        out[0] = vn
        out[1] = vt
        out[2] = (px * vt - y * vn) / square
        out[4] = float(CORNER_STICK)
        out[5] = shear / press
        return
    ratio = contact.friction if shear > 0.0 else -contact.friction
    fx = nx - ratio * ny
    fy = ny + ratio * nx
    arm = px * fy - y * fx
    lever = px * ny - y * nx
    push = (cn * nx + ct * ny) / max(1.0 + arm * lever / square, 0.05)
    out[0] = push * fx
    out[1] = push * fy
    out[2] = push * arm / square
    out[4] = float(CORNER_SLIDE)
    out[5] = ratio


@kernel
def contact_velocity(
    contact: Contact,
    offset: float,  # of the box's centre to the left of the robot's x axis [m]
    angle: float,  # of the face's normal against the robot's heading [rad]
    c: float,  # cosine and sine of the angle
    s: float,
    v: float,
    w: float,
    dt: float,  # step in which an open line of contact should close [s]
    out: FloatArray,  # (6,) of a box that touches the bumper
) -> float:
    """Fill v_n, v_t [m/s], ω [rad/s], pressure centre [m], mode, shear over normal force.

    Returns:
        The x of the box's centre [m].
    """
    x, touch = standoff_turned(contact, offset, c, s)
    ux = v - w * offset
    uy = w * x
    un = c * ux + s * uy
    ut = c * uy - s * ux
    low, high = line(contact, offset)
    curvature = contact.curvature
    a = contact.depth
    square = contact.spread * contact.spread
    if low >= high:
        _corner(contact, touch, 0.0, un, ut, w, out)
        return x
    if curvature < 0.0:  # a nose: one point that rolls along the face
        _corner(contact, touch, 0.0, un, ut, w, out)
        return x
    off = angle - flush_angle(contact, offset)
    slope = -curvature / (1.0 - curvature * a)
    closing = w - off / dt
    normal = un + (closing - w) * touch
    # held fast: no motion along the bumper
    vt = ut
    omega = closing
    grip = 1.0 - curvature * a
    shear = vt * grip - curvature * square * omega
    mode = STICK
    if abs(shear) > contact.friction * max(normal, 0.0):
        mode = SLIDE
        ratio = contact.friction if shear > 0.0 else -contact.friction
        vt = (ratio * max(normal, 0.0) + curvature * square * (closing - slope * ut)) / (
            grip - curvature * square * slope
        )
        omega = closing + slope * (vt - ut)
        shear = ratio * normal
    pressure = np.inf if omega < 0.0 else -np.inf
    if normal > 1e-12:
        pressure = -(square * omega + a * vt) / normal
    if low <= pressure <= high:
        out[0] = normal
        out[1] = vt
        out[2] = omega
        out[3] = pressure
        out[4] = float(mode)
        out[5] = shear / normal
        return x
    y = high if pressure > high else low
    tilt = 0.0
    if (y == contact.high and y == high) or (y == contact.low and y == low):
        lateral = offset - a * s + y * c
        tilt = -curvature * lateral - angle  # the box's corner on the bumper, not the bumper's end
    _corner(contact, y, tilt, un, ut, w, out)
    return x
