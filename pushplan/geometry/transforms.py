"""Rigid transforms of points, compiled; `pushplan.world.outline.transform` is the NumPy one."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray


@kernel
def transform_points(pose: FloatArray, points_body: FloatArray, out: FloatArray) -> None:
    """Carry (N, 2) points from the frame of a body at ``pose`` (3,) to the world, into ``out``."""
    c = np.cos(pose[2])
    s = np.sin(pose[2])
    for i in range(points_body.shape[0]):
        # ``out`` may be ``points_body`` itself
        x = points_body[i, 0]
        y = points_body[i, 1]
        out[i, 0] = pose[0] + c * x - s * y
        out[i, 1] = pose[1] + s * x + c * y


@kernel
def transform_outlines(
    poses: FloatArray, vertices: FloatArray, offsets: IntArray, out: FloatArray
) -> None:
    """Carry flattened outlines (V, 2) of K bodies from their frames to the world, into ``out``."""
    for k in range(poses.shape[0]):
        a = offsets[k]
        b = offsets[k + 1]
        transform_points(poses[k], vertices[a:b], out[a:b])


@kernel
def arc_step(pose: FloatArray, distance: float, turn: float, out: FloatArray) -> None:
    """Fill ``out`` (3,) with the pose that a step [m] with a turn [rad] leads to from ``pose``."""
    out[0] = pose[0] + distance * math.cos(pose[2] + 0.5 * turn)
    out[1] = pose[1] + distance * math.sin(pose[2] + 0.5 * turn)
    out[2] = pose[2] + turn
