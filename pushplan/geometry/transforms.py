"""Rigid transforms of points, in place; `pushplan.world.outline.transform` is the NumPy one."""

from __future__ import annotations

import numpy as np

from pushplan.core import geometry as core
from pushplan.world.checks import FloatArray, IntArray


def transform_points(pose: FloatArray, points_body: FloatArray, out: FloatArray) -> None:
    """Carry (N, 2) points from the frame of a body at ``pose`` (3,) to the world, into ``out``.

    ``out`` may be ``points_body`` itself.
    """
    core.transform_points(np.ascontiguousarray(pose), np.ascontiguousarray(points_body), out)


def transform_outlines(
    poses: FloatArray, vertices: FloatArray, offsets: IntArray, out: FloatArray
) -> None:
    """Carry flattened outlines (V, 2) of K bodies from their frames to the world, into ``out``."""
    core.transform_outlines(np.ascontiguousarray(poses), vertices, offsets, out)


def arc_step(pose: FloatArray, distance: float, turn: float, out: FloatArray) -> None:
    """Fill ``out`` (3,) with the pose that a step [m] with a turn [rad] leads to from ``pose``."""
    out[:] = core.arc_step(np.ascontiguousarray(pose), distance, turn)
