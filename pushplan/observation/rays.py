"""Compiled channels that start at the robot: the line ahead of it, and ways around obstacles."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.shadows import BendDistances, Table, fill_shadows
from pushplan.observation.view import Image, View, to_pixels
from pushplan.world.checks import FloatArray, IntArray


@kernel(allocates=True)
def draw_ray(
    image: Image,  # (H, W), changed in place
    x: float,  # where it starts [px], also outside the image
    y: float,  # where it starts [px], also outside the image
    dx: float,  # its direction, not zero
    dy: float,  # its direction, not zero
    value: int,  # what the pixels are set to
) -> None:
    """A line one pixel wide from a point to the edge of the image."""
    rows, cols = image.shape
    if abs(dx) >= abs(dy):
        step = 1 if dx > 0.0 else -1
        first = math.floor(x)
        # from outside it goes on where it meets the image
        col = max(first, -1) if step > 0 else min(first, cols)
        while 0 <= col < cols or (col < 0 and step > 0) or (col >= cols and step < 0):
            along = 0.0 if col == first else (col + 0.5 - x) / dx
            row = math.floor(y + along * dy)
            if 0 <= row < rows and 0 <= col < cols:
                image[row, col] = value
            col += step
    else:
        step = 1 if dy > 0.0 else -1
        first = math.floor(y)
        row = max(first, -1) if step > 0 else min(first, rows)
        while 0 <= row < rows or (row < 0 and step > 0) or (row >= rows and step < 0):
            along = 0.0 if row == first else (row + 0.5 - y) / dy
            col = math.floor(x + along * dx)
            if 0 <= col < cols and 0 <= row < rows:
                image[row, col] = value
            row += step


def fill_hidden(image: Image, view: View, source: BendDistances, per_metre: float) -> None:
    """Overwrite the pixels that the robot does not see by the length of the way to them.

    Args:
        image: (H, W), changed in place.
        view: the window.
        source: distances of the static map.
        per_metre: value of a pixel that is 1 m away; what passes 255, or is cut off, becomes 255.
    """
    pose = view.world.robot_pose
    bends, lengths = source.in_sight(float(pose[0]), float(pose[1]))
    origin, step = source.grid.origin, source.grid.resolution
    sight = _Sight(source.loops, source.offsets, source.table, origin, step, bends, lengths)
    _fill_hidden(image, view.numbers, pose[None, :2], sight, per_metre)


class _Sight(NamedTuple):
    """What the robot sees of the corners that shortest paths bend at."""

    loops: FloatArray  # (V, 2) outlines that cast shadows [m]
    offsets: IntArray  # where each begins
    table: Table  # (rows, columns, corners) distances from the corners [m]
    origin: FloatArray  # (2,) of the table [m]
    step: float  # side of its cells [m]
    bends: IntArray  # corners in sight
    lengths: FloatArray  # paths to them [m]


@kernel(allocates=True)
def _fill_hidden(
    image: Image,
    view: FloatArray,
    eye: FloatArray,  # (1, 2) the robot [m]
    sight: _Sight,
    per_metre: float,
) -> None:
    """Overwrite the pixels in the shadow of the loops by the length of the path to them."""
    loops, offsets, table, origin, step, bends, lengths = sight  # quicker than in the loops
    spots, at = np.empty_like(loops), np.empty((1, 2))
    to_pixels(view, loops, spots)
    to_pixels(view, eye, at)
    hidden = np.zeros(image.shape, dtype=np.uint8)
    fill_shadows(hidden, at[0, 0], at[0, 1], spots, offsets, 1)
    c, s = math.cos(view[2]), math.sin(view[2])
    rows, cols = table.shape[0], table.shape[1]
    for r in range(image.shape[0]):
        up = (0.5 * view[3] - r - 0.5) * view[5]
        for q in range(image.shape[1]):
            if not hidden[r, q]:
                continue
            left = (0.5 * view[4] - q - 0.5) * view[6]
            u = (view[0] + c * up - s * left - origin[0]) / step
            v = (view[1] + s * up + c * left - origin[1]) / step
            best = math.inf
            if 0.0 <= u < cols and 0.0 <= v < rows:  # ways stay inside the bounds
                i, j = int(v), int(u)
                for k in range(bends.shape[0]):
                    best = min(best, lengths[k] + table[i, j, bends[k]])
            image[r, q] = int(min(255.0, per_metre * best + 0.5))
