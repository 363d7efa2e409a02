"""Where a push begins, and along which way an object goes."""

from __future__ import annotations

import math

import numpy as np

from pushplan.planners.subtasks.rollout import along_path
from pushplan.planners.subtasks.scene import Scene
from pushplan.world.checks import FloatArray

SHIFTS = (0.0, 0.4, -0.4, 0.75, -0.75)
"""Places of the robot's middle beside the object, in half widths of the bumper."""


def axes_of(heading: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) along a heading [rad] and to the left of it."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c, s]), np.array([-s, c])


def behind(scene: Scene, k: int, heading: float, shift: float) -> FloatArray:
    """(3,) a pose behind object ``k`` from which to push it along a heading."""
    u, v = axes_of(heading)
    outline = scene.world.movables.outline_world(k)
    middle = scene.poses[k, :2]
    depth = float(((middle - outline) @ u).max()) + scene.front + scene.config.slack * scene.size
    return np.array([*(middle - depth * u + shift * v), heading])


def direction_of(path: FloatArray, ahead: float) -> float:
    """Heading [rad] from the start of a path to a point some way along it [m]."""
    x, y, _, _ = along_path(path[0, 0], path[0, 1], path, 0.0, ahead)
    return math.atan2(y - path[0, 1], x - path[0, 0])


def length_of(path: FloatArray) -> float:
    """Length [m] of a path (M, 2)."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())
