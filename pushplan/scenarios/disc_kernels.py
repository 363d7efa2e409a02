"""Compiled placing of discs at random places, where they touch nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.scenarios.floe_kernels import IceWater, nearest_point
from pushplan.world.checks import FloatArray, IntArray


class _Buckets(NamedTuple):
    """Placed discs in the cells of a grid."""

    head: IntArray  # (R, C) last disc in each cell, -1 for none
    following: IntArray  # (K,) the one before it in the same cell
    centres: FloatArray  # (K, 2) [m]
    radii: FloatArray  # (K,) [m]


@kernel(allocates=True)
def place_discs(
    radii: FloatArray,  # (K,) [m], largest first
    draws: FloatArray,  # (K, T, 3) uniform in [0, 1): place, and whether it is taken
    density: FloatArray,  # (R, C) chance that a place is taken, 0 to 1, over the box
    water: IceWater,
) -> FloatArray:
    """(J, 2) centres [m] of the first J discs, which found a place; K - J did not."""
    box = water.box
    count, tries = draws.shape[0], draws.shape[1]
    width, height = box[2] - box[0], box[3] - box[1]
    rows, cols = density.shape
    side = 2.0 * radii[0] + water.gap
    nx, ny = max(1, int(width / side)), max(1, int(height / side))
    buckets = _Buckets(
        np.full((ny, nx), -1, np.int64), np.full(count, -1, np.int64), np.empty((count, 2)), radii
    )
    for k in range(count):
        r = radii[k]
        done = False
        for t in range(tries):
            u, v = draws[k, t, 0], draws[k, t, 1]
            x = box[0] + r + u * max(0.0, width - 2.0 * r)
            y = box[1] + r + v * max(0.0, height - 2.0 * r)
            chance = density[
                min(rows - 1, int((y - box[1]) / height * rows)),
                min(cols - 1, int((x - box[0]) / width * cols)),
            ]
            # the second half of the draws of a disc takes any place
            if 2 * t < tries and draws[k, t, 2] > chance:
                continue
            i = min(nx - 1, int((x - box[0]) / width * nx))
            j = min(ny - 1, int((y - box[1]) / height * ny))
            reach = r + water.gap
            if _touches_disc(x, y, reach, i, j, buckets) or _touches_block(x, y, reach, water):
                continue
            buckets.centres[k, 0], buckets.centres[k, 1] = x, y
            buckets.following[k] = buckets.head[j, i]
            buckets.head[j, i] = k
            done = True
            break
        if not done:
            return buckets.centres[:k]
    return buckets.centres


@kernel
def _touches_disc(x: float, y: float, reach: float, i: int, j: int, buckets: _Buckets) -> bool:
    """Whether a disc of radius ``reach`` in column i and row j overlaps a placed one."""
    head, centres = buckets.head, buckets.centres
    for row in range(max(0, j - 1), min(head.shape[0], j + 2)):
        for col in range(max(0, i - 1), min(head.shape[1], i + 2)):
            q = head[row, col]
            while q >= 0:
                dx, dy = centres[q, 0] - x, centres[q, 1] - y
                far = reach + buckets.radii[q]
                if dx * dx + dy * dy < far * far:
                    return True
                q = buckets.following[q]
    return False


@kernel
def _touches_block(x: float, y: float, reach: float, water: IceWater) -> bool:
    """Whether a disc of radius ``reach`` overlaps a region to stay off."""
    offsets = water.block_offsets
    for b in range(offsets.shape[0] - 1):
        gap, _, _ = nearest_point(x, y, water.blocks[offsets[b] : offsets[b + 1]])
        if gap < reach:
            return True
    return False
