"""Compiled rasters of floes and hulls: how much of each cell is covered.

The frame (3,) of a raster is the world position [m] of the outer corner of cell (0, 0) and the
heading [rad] in which columns count up; rows count up to the left of it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pushplan.compiled import kernel
from pushplan.geometry.angles import wrap_angle
from pushplan.geometry.raster import fill_convex
from pushplan.geometry.transforms import transform_outlines, transform_points
from pushplan.world.checks import FloatArray, IntArray

Patch = NDArray[np.float32]

SUBCELLS = 4
"""Samples along each side of a cell: coverage comes in steps of 1/16."""


@kernel(allocates=True)
def _fill(
    corners: FloatArray,  # (V, 2) of convex outlines, world frame [m]; changed into samples
    offsets: IntArray,  # (P + 1,) where each outline starts
    frame: FloatArray,
    scale: float,  # samples per metre
    fine: NDArray[np.uint8],
) -> None:
    """Set the samples that lie in an outline to 1."""
    c = math.cos(frame[2])
    s = math.sin(frame[2])
    for i in range(corners.shape[0]):
        dx = corners[i, 0] - frame[0]
        dy = corners[i, 1] - frame[1]
        corners[i, 0] = scale * (c * dx + s * dy)
        corners[i, 1] = scale * (c * dy - s * dx)
    for part in range(offsets.shape[0] - 1):
        fill_convex(fine, corners[offsets[part] : offsets[part + 1]], 1)


@kernel
def _average(fine: NDArray[np.uint8], out: Patch) -> None:
    """Write the mean of the samples of each cell."""
    for r in range(out.shape[0]):
        for col in range(out.shape[1]):
            total = 0
            for i in range(SUBCELLS):
                for j in range(SUBCELLS):
                    total += fine[SUBCELLS * r + i, SUBCELLS * col + j]
            out[r, col] = total / (SUBCELLS * SUBCELLS)


@kernel(allocates=True)
def cover_objects(
    poses: FloatArray,  # (K, 3) of the objects, world frame
    vertices: FloatArray,  # (V, 2) outlines in body frames [m]
    offsets: IntArray,  # (K + 1,) where each outline starts
    frame: FloatArray,  # (3,) see the module
    cell: float,  # side of a cell [m]
    out: Patch,  # (H, W) receives values from 0 to 1
) -> None:
    """Write the fraction of each cell that lies under an object."""
    height, width = out.shape
    fine = np.zeros((SUBCELLS * height, SUBCELLS * width), np.uint8)
    scale = SUBCELLS / cell
    corners = np.empty_like(vertices)
    transform_outlines(poses, vertices, offsets, corners)
    _fill(corners, offsets, frame, scale, fine)
    _average(fine, out)


@kernel(allocates=True)
def cover_sweep(
    path: FloatArray,  # (N, 3) poses of the robot; between two of them it goes straight
    vertices: FloatArray,  # (V, 2) convex parts of the robot in its body frame [m]
    offsets: IntArray,  # (P + 1,) where each part starts
    frame: FloatArray,  # (3,) see the module
    cell: float,  # side of a cell [m]
    out: Patch,  # (H, W) receives values from 0 to 1
) -> None:
    """Write the fraction of each cell that a robot passes over; of one pose, its footprint."""
    height, width = out.shape
    fine = np.zeros((SUBCELLS * height, SUBCELLS * width), np.uint8)
    scale = SUBCELLS / cell
    corners = np.empty_like(vertices)
    reach = 0.0
    for i in range(vertices.shape[0]):
        reach = max(reach, math.hypot(vertices[i, 0], vertices[i, 1]))
    for n in range(path.shape[0]):
        steps = 1
        turn = 0.0
        if n > 0:
            turn = wrap_angle(path[n, 2] - path[n - 1, 2])
            length = math.hypot(path[n, 0] - path[n - 1, 0], path[n, 1] - path[n - 1, 1])
            steps = max(1, math.ceil((length + abs(turn) * reach) / (0.5 * cell)))
        for step in range(steps):
            back = step / steps
            pose = path[n].copy()
            if n > 0:
                pose[:2] -= back * (path[n, :2] - path[n - 1, :2])
                pose[2] -= back * turn
            transform_points(pose, vertices, corners)
            _fill(corners, offsets, frame, scale, fine)
    _average(fine, out)
