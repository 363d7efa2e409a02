"""Compiled distances of many boxes at once to the goal."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.distance_field import sample_values
from pushplan.world.checks import FloatArray


@kernel(allocates=True)
def sample_at(
    values: FloatArray,  # (rows, columns) distances [m], inf where no path leads to the goal
    ox: float,  # least x and y of the grid [m]
    oy: float,
    step: float,  # side of a cell [m]
    farthest: float,  # in place of inf [m]
    poses: FloatArray,  # (K, 3)
) -> FloatArray:
    """(K,) goal distance of each object [m], from a grid."""
    out = np.empty(poses.shape[0])
    for k in range(poses.shape[0]):
        found = sample_values(values, ox, oy, step, poses[k, 0], poses[k, 1])
        out[k] = found if found < math.inf else farthest
    return out
