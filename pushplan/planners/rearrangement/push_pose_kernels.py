"""Compiled poses of the robot behind an object."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free
from pushplan.planners.rearrangement.pose_grid_kernels import HEADINGS
from pushplan.world.checks import BoolArray, FloatArray


@kernel(allocates=True)
def pose_behind_outline(
    pose: FloatArray,  # (3,) of the object
    outline: FloatArray,  # (N, 2) in its frame [m]
    heading: float,
    shift: float,  # of the robot's middle to the left [m]
    distance: float,  # of the robot's middle from the outline [m]
) -> FloatArray:
    """(3,) pose of a robot that touches an outline from behind and faces along a heading."""
    c = math.cos(heading)
    s = math.sin(heading)
    cos = math.cos(pose[2])
    sin = math.sin(pose[2])
    depth = -np.inf
    for i in range(outline.shape[0]):
        x = outline[i, 0]
        y = outline[i, 1]
        depth = max(depth, -((cos * x - sin * y) * c + (sin * x + cos * y) * s))
    depth += distance
    return np.array([pose[0] - depth * c - shift * s, pose[1] - depth * s + shift * c, heading])


@kernel(allocates=True)
def pushable_moves(
    middles: FloatArray,  # (rows, cols, 2) of cells [m]
    is_open: BoolArray,  # (rows, cols) where an object may be
    shifts: FloatArray,  # (S,) of the robot's middle to the left of the object [m]
    distance: float,  # of the robot's middle behind the object's [m]
    shape: Footprint,
    among: ConvexObstacles,
) -> BoolArray:
    """(16, rows, cols) whether the robot fits behind an object to push it along each heading."""
    rows, cols = is_open.shape
    out = np.zeros((HEADINGS.shape[0], rows, cols), dtype=np.bool_)
    pose = np.empty(3)
    scratch = np.empty_like(shape.vertices)
    for t in range(HEADINGS.shape[0]):
        c = math.cos(HEADINGS[t])
        s = math.sin(HEADINGS[t])
        pose[2] = HEADINGS[t]
        for i in range(rows):
            for j in range(cols):
                if not is_open[i, j]:
                    continue
                for shift in shifts:
                    pose[0] = middles[i, j, 0] - distance * c - shift * s
                    pose[1] = middles[i, j, 1] - distance * s + shift * c
                    if is_free(pose, shape, among, scratch):
                        out[t, i, j] = True
                        break
    return out
