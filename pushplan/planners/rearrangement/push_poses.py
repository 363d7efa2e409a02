"""Poses from which pushes begin, and measures of paths and places."""

from __future__ import annotations

import math

import numpy as np

from pushplan.planners.rearrangement.controller_kernels import along_path
from pushplan.planners.rearrangement.push_pose_kernels import pose_behind_outline
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.world.checks import FloatArray


def heading_axes(heading: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) along a heading [rad] and to the left of it."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c, s]), np.array([-s, c])


def pose_behind(scene: PushScene, k: int, heading: float, shift: float) -> FloatArray:
    """(3,) a pose behind object ``k`` from which to push it along a heading.

    Args:
        scene: the scene.
        k: index of the object.
        heading: [rad].
        shift: how far the robot's middle is to the left of the object [m].
    """
    outline = scene.world.movables.outline(k)
    distance = scene.front + scene.config.slack * scene.size
    return pose_behind_outline(np.array(scene.poses[k]), outline, heading, shift, distance)


def initial_heading(path: FloatArray, ahead: float) -> float:
    """Heading [rad] from the start of a path to a point some distance along it [m]."""
    x, y, _, _ = along_path(path[0, 0], path[0, 1], path, 0.0, ahead)
    return math.atan2(y - path[0, 1], x - path[0, 0])


def pose_distance(pose: FloatArray, other: FloatArray, size: float) -> float:
    """How far two poses (3,) of an object are apart, turns included, in units of ``size``."""
    turn = math.remainder(float(pose[2] - other[2]), 2.0 * math.pi)
    return math.dist(pose[:2], other[:2]) / size + 0.2 * abs(turn)
