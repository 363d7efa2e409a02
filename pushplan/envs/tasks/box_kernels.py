"""Compiled questions about many boxes at once: where they are, and how far from the goal."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.convex import convex_penetration
from pushplan.geometry.distance_field import sample_values
from pushplan.geometry.transforms import transform_points
from pushplan.world.checks import BoolArray, FloatArray, IntArray


@kernel(allocates=True)
def all_corners_inside(
    poses: FloatArray, vertices: FloatArray, offsets: IntArray, polygon: FloatArray
) -> BoolArray:
    """Whether every corner of each object lies in a convex polygon; its outline counts.

    Args:
        poses: (K, 3) x, y [m], theta [rad].
        vertices: (V, 2) outlines in body frames, flattened [m].
        offsets: (K + 1,) where each outline starts.
        polygon: (N, 2) corners [m], counter-clockwise.

    Returns:
        (K,) flags.
    """
    inside = np.ones(poses.shape[0], dtype=np.bool_)
    corners = np.empty_like(vertices)
    for k in range(poses.shape[0]):
        a, b = offsets[k], offsets[k + 1]
        transform_points(poses[k], vertices[a:b], corners[a:b])
        for i in range(polygon.shape[0]):
            j = i + 1 if i + 1 < polygon.shape[0] else 0
            ex, ey = polygon[j, 0] - polygon[i, 0], polygon[j, 1] - polygon[i, 1]
            for c in range(a, b):
                side = ex * (corners[c, 1] - polygon[i, 1]) - ey * (corners[c, 0] - polygon[i, 0])
                if side < 0.0:
                    inside[k] = False
    return inside


@kernel(allocates=True)
def no_longer_touches(
    poses: FloatArray, vertices: FloatArray, offsets: IntArray, polygon: FloatArray
) -> BoolArray:
    """Whether the outline of each object is clear of a convex polygon.

    Arguments and result as in `all_corners_inside`.
    """
    clear = np.empty(poses.shape[0], dtype=np.bool_)
    corners = np.empty_like(vertices)
    for k in range(poses.shape[0]):
        a, b = offsets[k], offsets[k + 1]
        transform_points(poses[k], vertices[a:b], corners[a:b])
        depth, _, _ = convex_penetration(corners[a:b], polygon)
        clear[k] = depth < 0.0
    return clear


@kernel(allocates=True)
def sample_at(
    values: FloatArray, ox: float, oy: float, step: float, farthest: float, poses: FloatArray
) -> FloatArray:
    """Goal distance of each object [m], from a grid; ``farthest`` where no way leads to the goal.

    Args:
        values: (rows, columns) distances [m], inf where there is no way.
        ox: least x of the grid [m].
        oy: least y of the grid [m].
        step: side of a cell [m].
        farthest: greatest value that is returned [m].
        poses: (K, 3) x, y [m], theta [rad].

    Returns:
        (K,) distances [m].
    """
    out = np.empty(poses.shape[0])
    for k in range(poses.shape[0]):
        found = sample_values(values, ox, oy, step, poses[k, 0], poses[k, 1])
        out[k] = found if found < math.inf else farthest
    return out
