"""Rigid transforms of points, in place; `pushplan.world.outline.transform` is the NumPy one."""

from __future__ import annotations

import numpy as np

from pushplan.core import geometry as core
from pushplan.errors import short
from pushplan.world import InvalidInputError
from pushplan.world.checks import FloatArray, IntArray, array


def transform_points(pose: FloatArray, points_body: FloatArray, out: FloatArray) -> None:
    """Carry (N, 2) points from the frame of a body at ``pose`` (3,) to the world, into ``out``.

    ``out`` may be ``points_body`` itself.
    """
    points: FloatArray = array("points_body", points_body, (None, 2))
    core.transform_points(array("pose", pose, (3,)), points, _room("out", out, len(points)))


def transform_outlines(
    poses: FloatArray, vertices: FloatArray, offsets: IntArray, out: FloatArray
) -> None:
    """Carry flattened outlines (V, 2) of K bodies from their frames to the world, into ``out``."""
    corners: FloatArray = array("vertices", vertices, (None, 2))
    starts: IntArray = array("offsets", offsets, (None,), dtype=np.int64)
    bodies: FloatArray = array("poses", poses, (None, 3))
    core.transform_outlines(bodies, corners, starts, _room("out", out, len(corners)))


def arc_step(pose: FloatArray, distance: float, turn: float, out: FloatArray) -> None:
    """Fill ``out`` (3,) with the pose that a step [m] with a turn [rad] leads to from ``pose``."""
    out[:] = core.arc_step(np.ascontiguousarray(pose), distance, turn)


def _room(name: str, out: FloatArray, count: int) -> FloatArray:
    """Check an array (N, 2) that receives ``count`` points."""
    if (
        not isinstance(out, np.ndarray)
        or out.dtype != np.float64
        or out.ndim != 2
        or out.shape[1] != 2
        or len(out) < count
        or not (out.flags.c_contiguous and out.flags.writeable)
    ):
        raise InvalidInputError(
            f"{name} must be a writeable, contiguous array of float64 of shape ({count}, 2), "
            f"or of more rows, got {short(out)}"
        )
    return out
