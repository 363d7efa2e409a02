"""Compiled geometric pushing controller: it steers the target object along a path.

The robot heads where the object has to go, turned towards the side to which the object has slipped
on the bumper.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.world.checks import FloatArray


class PushingController(NamedTuple):
    """Parameters of the geometric pushing controller."""

    step: float  # Distance between two commands [m]
    turn: float  # Greatest turn in one step [rad]
    size: float  # Circumscribed radius of the robot [m]
    half: float  # Half the width of the bumper [m]
    front: float  # Distance of the bumper ahead of the robot's origin [m]
    ahead: float  # Look-ahead distance of the object on its path [m]
    gain: float
    """Curvature of the robot's path for each radian that it is off its heading, times ``size``."""


@kernel
def along_path(
    x: float, y: float, path: FloatArray, reached: float, ahead: float
) -> tuple[float, float, float, float]:
    """The carrot (x, y), the arc length of the nearest point from ``reached`` on, its distance."""
    best = np.inf
    at = reached
    arc = 0.0
    for i in range(path.shape[0] - 1):
        dx = path[i + 1, 0] - path[i, 0]
        dy = path[i + 1, 1] - path[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > 0.0 and arc + length >= reached and arc <= reached + 3.0 * ahead:
            t = ((x - path[i, 0]) * dx + (y - path[i, 1]) * dy) / length
            t = min(max(t, max(0.0, reached - arc)), length)
            px = path[i, 0] + t / length * dx
            py = path[i, 1] + t / length * dy
            away = math.sqrt((px - x) ** 2 + (py - y) ** 2)
            if away < best:
                best = away
                at = arc + t
        arc += length
    target = at + ahead
    arc = 0.0
    for i in range(path.shape[0] - 1):
        dx = path[i + 1, 0] - path[i, 0]
        dy = path[i + 1, 1] - path[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > 0.0 and (arc + length >= target or i == path.shape[0] - 2):
            t = (target - arc) / length  # beyond the end the last leg goes on
            return path[i, 0] + t * dx, path[i, 1] + t * dy, at, best
        arc += length
    return path[-1, 0], path[-1, 1], at, best


@kernel
def is_on_bumper(robot: FloatArray, target: FloatArray, controller: PushingController) -> bool:
    """Return True if the middle of an object at a pose (3,) is in front of the bumper."""
    gx = target[0] - robot[0]
    gy = target[1] - robot[1]
    c = math.cos(robot[2])
    s = math.sin(robot[2])
    side = c * gy - s * gx
    forward = c * gx + s * gy
    return bool(abs(side) < 0.95 * controller.half and forward > 0.5 * controller.front)


@kernel
def steer_push(
    robot: FloatArray,  # (3,) pose
    target: FloatArray,  # (3,) pose of the target object
    path: FloatArray,  # (M, 2) for its middle [m]
    reached: float,  # arc length that it has got to [m]
    shift: float,  # wanted offset of the robot's middle to the left of the object [m]
    controller: PushingController,
) -> tuple[float, float, float, bool]:
    """Step [m], turn [rad], arc length now [m], and whether the object is still on the bumper."""
    cx, cy, at, _ = along_path(target[0], target[1], path, reached, controller.ahead)
    heading = math.atan2(cy - target[1], cx - target[0])
    error = wrap_angle(heading - robot[2])
    gx = target[0] - robot[0]
    gy = target[1] - robot[1]
    ux = math.cos(heading)
    uy = math.sin(heading)
    left = gx * uy - gy * ux
    holds = is_on_bumper(robot, target, controller) and abs(error) < 1.75
    correction = error - math.atan((left - shift) / controller.size)
    wanted = controller.gain * correction * controller.step / controller.size
    return controller.step, min(max(wanted, -controller.turn), controller.turn), at, holds
