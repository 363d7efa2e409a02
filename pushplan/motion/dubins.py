"""Arcs, and the shortest forward paths of bounded curvature (Dubins 1957), compiled.

An arc is a length [m], negative for back, and a curvature [1/m]. A turn on the spot is one of
infinite curvature, whose length is its angle [rad].

The six words are solved as in Shkel and Lumelsky, "Classification of the Dubins set" (2001),
with start at the origin and lengths in units of the turning radius.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray

_TWO_PI = 2.0 * np.pi
MAX_TURN = 0.15
"""Greatest change of heading between two poses of a path [rad]."""


@kernel
def _turn(angle: float) -> float:
    """Angle in [0, 2π); a turn that is full but for rounding is none."""
    angle = angle % _TWO_PI
    return 0.0 if angle > _TWO_PI - 1e-9 else angle


@kernel
def dubins(
    start: FloatArray,  # (3,) x, y [m], theta [rad]
    end: FloatArray,  # (3,)
    radius: float,  # least turning radius [m]
    out: FloatArray,  # (3, 2) receives length [m] and curvature [1/m] of the three pieces
) -> float:
    """Length [m] of the shortest forward path between two poses under a curvature bound."""
    dx = end[0] - start[0]
    dy = end[1] - start[1]
    d = np.sqrt(dx * dx + dy * dy) / radius
    phi = np.arctan2(dy, dx)
    a = _turn(start[2] - phi)
    b = _turn(end[2] - phi)
    sa = np.sin(a)
    ca = np.cos(a)
    sb = np.sin(b)
    cb = np.cos(b)
    cab = np.cos(a - b)
    best = np.inf
    # squares are compared with -1e-9, since rounding may take a zero below zero
    # each word as (first turn, second, third) with +1 left, 0 straight, -1 right
    for word in range(6):
        t = p = q = -1.0
        if word == 0:  # LSL
            square = 2.0 + d * d - 2.0 * cab + 2.0 * d * (sa - sb)
            if square > -1e-9:
                heading = np.arctan2(cb - ca, d + sa - sb)
                t = _turn(heading - a)
                p = np.sqrt(max(square, 0.0))
                q = _turn(b - heading)
        elif word == 1:  # RSR
            square = 2.0 + d * d - 2.0 * cab + 2.0 * d * (sb - sa)
            if square > -1e-9:
                heading = np.arctan2(ca - cb, d - sa + sb)
                t = _turn(a - heading)
                p = np.sqrt(max(square, 0.0))
                q = _turn(heading - b)
        elif word == 2:  # LSR
            square = d * d - 2.0 + 2.0 * cab + 2.0 * d * (sa + sb)
            if square > -1e-9:
                p = np.sqrt(max(square, 0.0))
                heading = np.arctan2(-ca - cb, d + sa + sb) - np.arctan2(-2.0, p)
                t = _turn(heading - a)
                q = _turn(heading - b)
        elif word == 3:  # RSL
            square = d * d - 2.0 + 2.0 * cab - 2.0 * d * (sa + sb)
            if square > -1e-9:
                p = np.sqrt(max(square, 0.0))
                heading = np.arctan2(ca + cb, d - sa - sb) - np.arctan2(2.0, p)
                t = _turn(a - heading)
                q = _turn(b - heading)
        else:  # RLR and LRL
            side = 1.0 if word == 4 else -1.0
            cosine = (6.0 - d * d + 2.0 * cab + side * 2.0 * d * (sa - sb)) / 8.0
            if abs(cosine) <= 1.0:
                p = _turn(_TWO_PI - np.arccos(cosine))
                if word == 4:
                    t = _turn(a - np.arctan2(ca - cb, d - sa + sb) + 0.5 * p)
                    q = _turn(a - b - t + p)
                else:
                    t = _turn(-a + np.arctan2(cb - ca, d + sa - sb) + 0.5 * p)
                    q = _turn(b - a - t + p)
        if t < 0.0 or p < 0.0 or q < 0.0 or t + p + q >= best:
            continue
        best = t + p + q
        left = 1.0 / radius
        first = left if word in (0, 2, 5) else -left
        middle = 0.0 if word < 4 else -first
        last = first if word in (0, 1, 4, 5) else -first
        out[0, 0] = t * radius
        out[0, 1] = first
        out[1, 0] = p * radius
        out[1, 1] = middle
        out[2, 0] = q * radius
        out[2, 1] = last
    return best * radius


@kernel
def along_arc(pose: FloatArray, length: float, curvature: float, out: FloatArray) -> None:
    """Drive ``length`` [m] along an arc of constant curvature [1/m] from ``pose`` (3,)."""
    if np.isinf(curvature):
        out[0] = pose[0]
        out[1] = pose[1]
        out[2] = pose[2] + length * np.sign(curvature)
        return
    turn = length * curvature
    half = 0.5 * turn
    # chord of the arc; sinc keeps the straight limit exact
    chord = length if abs(half) < 1e-9 else length * np.sin(half) / half
    heading = pose[2] + half
    out[0] = pose[0] + chord * np.cos(heading)
    out[1] = pose[1] + chord * np.sin(heading)
    out[2] = pose[2] + turn


@kernel
def step_along(curvature: float, spacing: float) -> float:
    """Distance between poses on an arc [m]: ``spacing``, less where that would turn too far."""
    if np.isinf(curvature):
        return MAX_TURN
    return min(spacing, MAX_TURN / max(abs(curvature), 1e-12))


@kernel
def sample_pieces(
    start: FloatArray,  # (3,) pose at the beginning
    pieces: FloatArray,  # (P, 2) length [m] and curvature [1/m] of each arc
    spacing: float,  # greatest distance between two poses [m]; less in tight turns
    out: FloatArray,  # (M, 3) receives the poses
    curvatures: FloatArray,  # (M,) receives the curvature that leads to each pose [1/m]
) -> int:
    """Number of poses along arcs, without the start itself, or -1 if ``out`` is too short."""
    count = 0
    here = start
    for i in range(pieces.shape[0]):
        length = pieces[i, 0]
        curvature = pieces[i, 1]
        if abs(length) < 1e-8 * spacing:
            continue
        steps = int(np.ceil(abs(length) / step_along(curvature, spacing)))
        if count + steps > out.shape[0]:
            return -1
        for step in range(1, steps + 1):
            along_arc(here, length * step / steps, curvature, out[count])
            curvatures[count] = curvature
            count += 1
        here = out[count - 1]
    return count
