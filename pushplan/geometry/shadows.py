"""Distances from a moving viewpoint around static obstacles, fast enough for every control step.

A raster holds, for each cell, the exact distances to the bends of the visibility graph. From a
viewpoint everything in sight is as far as the eye says; what lies in the shadow of an obstacle is
reached over a bend that the viewpoint sees. Shadows of convex shapes are convex, so they are
filled like any other polygon instead of being tested cell by cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pushplan.compiled import kernel
from pushplan.geometry.contours import Contours, contours_of, gap_of, standoff_of
from pushplan.geometry.grid import Grid, occupancy
from pushplan.geometry.obstacles import Obstacles, line_of_sight, obstacle_distance, obstacles_of
from pushplan.geometry.raster import fill_convex
from pushplan.geometry.shortest_path import bends_of
from pushplan.geometry.visibility import is_tangent
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen

MAX_VALUES = 2**23
"""A table of distances has at most so many entries; larger maps get coarser cells."""
TOUCH = 1e-6
"""A viewpoint this close to a side or a corner is on it [px]."""

Mask = NDArray[np.uint8]
Table = NDArray[np.float32]


@kernel(allocates=True)
def _outermost(x: float, y: float, corners: FloatArray) -> tuple[int, int]:
    """The two corners of a convex polygon between which a viewpoint sees it; -1 from inside."""
    n = corners.shape[0]
    first = last = -1
    left = right = shared = False
    ax = ay = bx = by = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        dx = corners[i, 0] - x
        dy = corners[i, 1] - y
        ex = corners[j, 0] - x
        ey = corners[j, 1] - y
        side = dx * ey - dy * ex
        if dx * ex + dy * ey < 0.0 and abs(side) <= TOUCH * math.hypot(ex - dx, ey - dy):
            return i, j  # on this side
        left = left or side > 0.0
        right = right or side < 0.0
        if dx * dx + dy * dy <= TOUCH * TOUCH:
            shared = True
            continue
        if first < 0 or ax * dy - ay * dx > 0.0:
            first = i
            ax = dx
            ay = dy
        if last < 0 or bx * dy - by * dx < 0.0:
            last = i
            bx = dx
            by = dy
    if not shared and not (left and right):
        return -1, -1
    return first, last


@kernel(allocates=True)
def fill_shadow(mask: Mask, x: float, y: float, corners: FloatArray, value: int) -> None:
    """Fill a convex polygon (N, 2) [px] and all that it hides from x, y; none from inside."""
    n = corners.shape[0]
    first, last = _outermost(x, y, corners)
    if first < 0:
        return
    ax = corners[first, 0] - x
    ay = corners[first, 1] - y
    bx = corners[last, 0] - x
    by = corners[last, 1] - y
    far = 4.0 * (mask.shape[0] + mask.shape[1] + abs(x) + abs(y))
    a = far / math.hypot(ax, ay)
    b = far / math.hypot(bx, by)
    mx = ax * a + bx * b
    my = ay * a + by * b
    size = math.hypot(mx, my)
    if size < 1e-3 * far:  # seen from one of its sides: the way across it
        across = 0.0
        for i in range(n):
            side = ax * (corners[i, 1] - y) - ay * (corners[i, 0] - x)
            if abs(side) > abs(across):
                across = side
        turn = 1.0 if across > 0.0 else -1.0
        mx = -turn * ay
        my = turn * ax
        size = math.hypot(ax, ay)
    # all corners, then out along one edge of the shadow and back along the other; what lies
    # inside the hull of these does not change which pixels are filled
    hull = np.empty((n + 5, 2))
    for i in range(n + 1):
        k = (first + i) % n
        hull[i, 0] = corners[k, 0]
        hull[i, 1] = corners[k, 1]
    hull[n + 1, 0] = x + ax * a
    hull[n + 1, 1] = y + ay * a
    hull[n + 2, 0] = x + mx * far / size
    hull[n + 2, 1] = y + my * far / size
    hull[n + 3, 0] = x + bx * b
    hull[n + 3, 1] = y + by * b
    hull[n + 4, 0] = corners[last, 0]
    hull[n + 4, 1] = corners[last, 1]
    fill_convex(mask, hull, value)


@kernel(allocates=True)
def fill_shadows(
    mask: Mask, x: float, y: float, corners: FloatArray, offsets: IntArray, value: int
) -> None:
    """`fill_shadow` for each of P polygons that are flattened into one array [px]."""
    for k in range(offsets.shape[0] - 1):
        fill_shadow(mask, x, y, corners[offsets[k] : offsets[k + 1]], value)


@kernel(allocates=True)
def _fill_table(
    table: Table,
    origin: FloatArray,
    step: float,
    bends: Contours,
    between: FloatArray,
    loops: FloatArray,
    offsets: IntArray,
    gap: float,
) -> None:
    """Distance of each cell to each bend, over the bends that the cell sees."""
    rows, cols, count = table.shape
    spots = np.empty_like(loops)
    eyes = np.empty_like(bends.corners)
    for axis in range(2):
        spots[:, axis] = (loops[:, axis] - origin[axis]) / step
        eyes[:, axis] = (bends.corners[:, axis] - origin[axis]) / step
    hidden = np.zeros((count, rows, cols), dtype=np.uint8)
    for k in range(count):
        fill_shadows(hidden[k], eyes[k, 0], eyes[k, 1], spots, offsets, 1)
    best = np.empty(count)
    for i in range(rows):
        for j in range(cols):
            best[:] = math.inf
            for k in range(count):
                dx = (j + 0.5 - eyes[k, 0]) * step
                dy = (i + 0.5 - eyes[k, 1]) * step
                if hidden[k, i, j] or not is_tangent(
                    dx, dy, bends.incoming, bends.outgoing, k, gap
                ):
                    continue
                length = math.sqrt(dx * dx + dy * dy)
                for m in range(count):
                    best[m] = min(best[m], length + between[k, m])
            for m in range(count):
                table[i, j, m] = best[m]


@kernel(allocates=True)
def _bends_in_sight(
    x: float, y: float, bends: Contours, obstacles: Obstacles, gap: float, sliver: float
) -> tuple[IntArray, FloatArray]:
    """Corners that x, y sees along a tangent, and their distances [m]."""
    clearance = obstacle_distance(x, y, obstacles)
    count = bends.corners.shape[0]
    found = np.empty(count, dtype=np.int64)
    lengths = np.empty(count)
    n = 0
    for k in range(count):
        qx = bends.corners[k, 0]
        qy = bends.corners[k, 1]
        if clearance > sliver and not is_tangent(
            x - qx, y - qy, bends.incoming, bends.outgoing, k, gap
        ):
            continue
        if line_of_sight(x, y, qx, qy, obstacles, gap):
            found[n] = k
            lengths[n] = math.hypot(x - qx, y - qy)
            n += 1
    return found[:n], lengths[:n]


@dataclass(frozen=True, eq=False)
class BendDistances:
    """Distances of every cell of a map to every bend around its obstacles."""

    static: StaticMap  # the map
    grid: Grid  # place of the cells
    # (rows, columns, B) length [m] of the shortest way that goes on past the bend; inf where no way
    # leads. Cells inside an obstacle have the value of the nearest free one.
    table: Table
    bends: Contours  # the B places where shortest paths bend
    loops: FloatArray  # (V, 2) corners of convex polygons just around the obstacles [m], flattened
    offsets: IntArray  # (P + 1,) where each polygon starts

    def in_sight(self, x: float, y: float) -> tuple[IntArray, FloatArray]:
        """Bends over which a shortest path from a point [m] may lead, and how far each is [m]."""
        sliver = standoff_of(self.static, 0.0)
        around = obstacles_of(self.static)
        return _bends_in_sight(x, y, self.bends, around, gap_of(self.static), sliver)


@lru_cache(maxsize=4)
def bend_distances(
    static: StaticMap,  # obstacles and bounds
    resolution: float,  # side of a cell [m]; more where the table would pass `MAX_VALUES`
) -> BendDistances:
    """The distances of a map, kept for the maps used last."""
    bends, between = bends_of(static)
    width, height = (static.bounds[2:] - static.bounds[:2]).tolist()
    count = len(bends.corners)
    coarsest = math.sqrt(width * height * max(1, count) / MAX_VALUES)
    grid = Grid.cover(static.bounds, max(resolution, 1.01 * coarsest))
    contours = contours_of(static)
    ends = np.flatnonzero(np.diff(contours.owner, append=-1)) + 1
    offsets = np.zeros(1, dtype=np.int64)
    if len(contours.owner):
        offsets = np.concatenate([offsets, ends])
    offsets = frozen(offsets)
    table = np.empty((*grid.shape, count), dtype=np.float32)
    _fill_table(
        table,
        grid.origin,
        grid.resolution,
        bends,
        between,
        contours.corners,
        offsets,
        gap_of(static),
    )
    if count:
        blocked = occupancy(static, grid, 2.0 * standoff_of(static, 0.0))
        if blocked.any() and not blocked.all():
            rows, cols = ndimage.distance_transform_edt(
                blocked, return_distances=False, return_indices=True
            )
            table[blocked] = table[rows[blocked], cols[blocked]]
    return BendDistances(static, grid, frozen(table), bends, contours.corners, offsets)
