"""A grid over obstacles, so that a line of sight is tested against those near it only."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.obstacles import Obstacles, crosses_obstacle, obstacles_of
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen

_PER_OBSTACLE = 4  # cells for each obstacle
_MOST = 65_536  # cells at most
_NONE = frozen(np.zeros(0, dtype=np.int64))


class ObstacleGrid(NamedTuple):
    """Index of the obstacles that reach into each cell."""

    origin: FloatArray  # (2,) least x, y [m]
    cell: float  # side of a cell [m]
    rows: int
    columns: int
    first: IntArray  # (rows * columns + 1,) where the obstacles of each cell start
    items: IntArray  # (N,) their indices


@lru_cache(maxsize=32)
def obstacle_grid(static: StaticMap, clearance: float, margin: float) -> ObstacleGrid:
    """The grid over obstacles grown by ``clearance`` and ``margin`` [m]."""
    boxes = obstacles_of(static, clearance).boxes
    if not len(boxes):
        return ObstacleGrid(frozen(np.zeros(2)), 1.0, 0, 0, frozen(np.zeros(1, np.int64)), _NONE)
    low = boxes[:, :2].min(axis=0) - margin
    high = boxes[:, 2:].max(axis=0) + margin
    extent = np.maximum(high - low, 1e-9 * float((high - low).max()))
    cells = min(_PER_OBSTACLE * len(boxes), _MOST)
    cell = max(math.sqrt(float(extent[0] * extent[1]) / cells), float(extent.max()) / cells)
    columns, rows = (int(side / cell) + 1 for side in extent)
    empty = ObstacleGrid(low, cell, rows, columns, np.zeros(rows * columns + 1, np.int64), _NONE)
    first, items = _fill(empty, obstacles_of(static, clearance), margin)
    return empty._replace(origin=frozen(low), first=frozen(first), items=frozen(items))


@kernel
def _span(low: float, high: float, count: int) -> tuple[int, int]:
    """First and last cell of an interval [cells]; rounding may put a point into the next one."""
    return max(math.floor(low - 1e-6), 0), min(math.floor(high + 1e-6), count - 1)


@kernel
def _rows_of(
    k: int, column: int, grid: ObstacleGrid, obstacles: Obstacles, reach: float
) -> tuple[int, int]:
    """First and last row of the cells of a column that an obstacle's core comes near to."""
    first = obstacles.offsets[k]
    last = obstacles.offsets[k + 1]
    left = grid.origin[0] + column * grid.cell - reach
    right = left + grid.cell + 2.0 * reach
    low = math.inf
    high = -math.inf
    for i in range(first, last):
        j = i + 1 if i + 1 < last else first
        ax = obstacles.vertices[i, 0]
        ay = obstacles.vertices[i, 1]
        dx = obstacles.vertices[j, 0] - ax
        dy = obstacles.vertices[j, 1] - ay
        t0 = 0.0
        t1 = 1.0
        if abs(dx) > 1e-9 * grid.cell:
            u = (left - ax) / dx
            v = (right - ax) / dx
            t0 = max(t0, min(u, v))
            t1 = min(t1, max(u, v))
        elif ax + max(dx, 0.0) < left or ax + min(dx, 0.0) > right:
            continue
        if t0 <= t1:
            low = min(low, ay + min(t0 * dy, t1 * dy))
            high = max(high, ay + max(t0 * dy, t1 * dy))
    if low > high:
        return 0, -1
    oy = grid.origin[1]
    cell = grid.cell
    return _span((low - reach - oy) / cell, (high + reach - oy) / cell, grid.rows)


@kernel(allocates=True)
def _fill(grid: ObstacleGrid, obstacles: Obstacles, margin: float) -> tuple[IntArray, IntArray]:
    """Lists of obstacles by cell: where each starts, and all of them."""
    first = grid.first.copy()
    boxes = obstacles.boxes
    items = np.empty(0, dtype=np.int64)
    used = first[:-1].copy()
    for counting in (True, False):
        if not counting:
            for at in range(first.shape[0] - 1):
                first[at + 1] += first[at]
            items = np.empty(first[-1], dtype=np.int64)
            used = first[:-1].copy()
        for k in range(boxes.shape[0]):
            reach = obstacles.radii[k] + margin
            ox = grid.origin[0]
            low = boxes[k, 0] - margin - ox
            high = boxes[k, 2] + margin - ox
            left, right = _span(low / grid.cell, high / grid.cell, grid.columns)
            for c in range(left, right + 1):
                bottom, top = _rows_of(k, c, grid, obstacles, reach)
                for r in range(bottom, top + 1):
                    at = r * grid.columns + c
                    if counting:
                        first[at + 1] += 1
                    else:
                        items[used[at]] = k
                        used[at] += 1
    return first, items


@kernel
def sees(
    px: float,
    py: float,
    qx: float,
    qy: float,
    obstacles: Obstacles,
    margin: float,  # [m], at most that of the grid
    grid: ObstacleGrid,
    seen: IntArray,  # (C + 1,) memory; the last entry counts calls
) -> bool:
    """`line_of_sight` with a grid."""
    stamp = seen[seen.shape[0] - 1] + 1
    seen[seen.shape[0] - 1] = stamp
    cell = grid.cell
    ox = grid.origin[0]
    oy = grid.origin[1]
    u0 = (px - ox) / cell
    v0 = (py - oy) / cell
    u1 = (qx - ox) / cell
    v1 = (qy - oy) / cell
    left = min(u0, u1) - 1e-6
    right = max(u0, u1) + 1e-6
    first, last = _span(left, right, grid.columns)
    slope = (v1 - v0) / (u1 - u0) if abs(u1 - u0) > 1e-6 else math.inf
    for c in range(first, last + 1):
        low = min(v0, v1)
        high = max(v0, v1)
        if slope < math.inf and slope > -math.inf:
            a = v0 + (max(left, c) - u0) * slope
            b = v0 + (min(right, c + 1) - u0) * slope
            low = max(low, min(a, b))
            high = min(high, max(a, b))
        bottom, top = _span(low, high, grid.rows)
        for r in range(bottom, top + 1):
            at = r * grid.columns + c
            for i in range(grid.first[at], grid.first[at + 1]):
                k = grid.items[i]
                if seen[k] != stamp:
                    seen[k] = stamp
                    if crosses_obstacle(px, py, qx, qy, obstacles, k, margin):
                        return False
    return True
