"""Compiled geometry of tracking: places and errors on a path, and the arc of a constant twist."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.world.checks import FloatArray


class ReferencePath(NamedTuple):
    """A path as the kernels read it."""

    poses: FloatArray  # (M, 3) x, y [m], theta [rad]
    lengths: FloatArray  # (M,) path length from the first pose [m]
    speeds: FloatArray  # (M,) forward speed from each pose on [m/s]


class Tuning(NamedTuple):
    """Limits and weights, as `MpcConfig` and the robot give them."""

    size: float  # R [m]
    max_speed: float
    max_turn_rate: float
    max_acceleration: float
    stops: bool  # True if the robot stops at the end of the path
    optimise_speed: bool
    heading_weight: float
    turn_weight: float
    smoothness: float
    terminal: float
    speed_weight: float


@kernel
def locate(
    track: ReferencePath, x: float, y: float, low: float, high: float
) -> tuple[float, int, float]:
    """Path length [m], segment and fraction of it of the nearest point between two lengths [m]."""
    # past the last pose the path goes on straight
    poses = track.poses
    lengths = track.lengths
    last = poses.shape[0] - 1
    best = np.inf
    along = lengths[last]
    index = last
    fraction = 0.0
    i = max(0, int(np.searchsorted(lengths, low, side="right")) - 1)
    while i < last and lengths[i] <= high:
        ax = poses[i, 0]
        ay = poses[i, 1]
        ex = poses[i + 1, 0] - ax
        ey = poses[i + 1, 1] - ay
        square = ex * ex + ey * ey
        t = 0.0
        if square > 1e-18:
            t = min(max(((x - ax) * ex + (y - ay) * ey) / square, 0.0), 1.0)
        dx = x - ax - t * ex
        dy = y - ay - t * ey
        gap = dx * dx + dy * dy
        if gap < best:
            best = gap
            index = i
            fraction = t
            along = lengths[i] + t * (lengths[i + 1] - lengths[i])
        i += 1
    if index >= last - 1 and (index == last or fraction >= 1.0):
        cx = np.cos(poses[last, 2])
        sy = np.sin(poses[last, 2])
        over = (x - poses[last, 0]) * cx + (y - poses[last, 1]) * sy
        along = lengths[last] + max(over, 0.0)
        index = last
        fraction = 0.0
    return along, index, fraction


@kernel
def errors(
    track: ReferencePath, x: float, y: float, theta: float, index: int, fraction: float
) -> tuple[float, float, float, float]:
    """Offset [m, left positive], heading error, path heading [rad] and curvature [1/m]."""
    # between two poses the path is the arc that their headings ask for, not its chord
    poses = track.poses
    last = poses.shape[0] - 1
    i = min(index, last)
    ax = poses[i, 0]
    ay = poses[i, 1]
    heading = poses[i, 2]
    curvature = 0.0
    bulge = 0.0
    nx = -np.sin(heading)
    ny = np.cos(heading)
    if i < last:
        ex = poses[i + 1, 0] - ax
        ey = poses[i + 1, 1] - ay
        length = np.sqrt(ex * ex + ey * ey)
        turn = wrap_angle(poses[i + 1, 2] - heading)
        if length > 1e-9:
            nx = -ey / length
            ny = ex / length
            slip = wrap_angle(np.arctan2(ey, ex) - heading - 0.5 * turn)
            if abs(slip) < 0.1 * abs(turn):  # an arc; else the corner of a polyline
                curvature = turn / length
                bulge = -0.5 * turn * length * fraction * (1.0 - fraction)
            ax = ax + fraction * ex
            ay = ay + fraction * ey
        heading += fraction * turn
    offset = (x - ax) * nx + (y - ay) * ny - bulge
    return offset, wrap_angle(theta - heading), heading, curvature


@kernel
def arc(
    x: float,
    y: float,
    theta: float,
    v: float,
    w: float,
    dt: float,
    out: FloatArray,  # (9,)
) -> None:
    """Fill the pose after a constant twist, its dx, dy, d(x, y)/dw and d(x, y)/dv."""
    half = 0.5 * w * dt
    if abs(half) > 1e-4:
        sinc = np.sin(half) / half
        slope = (np.cos(half) * half - np.sin(half)) / (half * half)
    else:
        sinc = 1.0 - half * half / 6.0
        slope = -half / 3.0
    c = np.cos(theta + half)
    s = np.sin(theta + half)
    chord = v * dt * sinc
    out[3] = chord * c
    out[4] = chord * s
    out[0] = x + out[3]
    out[1] = y + out[4]
    out[2] = theta + w * dt
    rate = v * dt * slope * 0.5 * dt
    out[5] = rate * c - chord * s * 0.5 * dt
    out[6] = rate * s + chord * c * 0.5 * dt
    out[7] = dt * sinc * c
    out[8] = dt * sinc * s
