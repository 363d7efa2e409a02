"""Least driven length to the goal from every pose, around walls and under the turn limit.

The value function of a forward car of bounded curvature on a grid of (x, y, heading), solved by
semi-Lagrangian Gauss-Seidel sweeps: from each cell centre short arcs are driven, and the value
where they end is interpolated (Falcone and Ferretti, "Semi-Lagrangian Approximation Schemes for
Linear and Hamilton-Jacobi Equations", 2013; for cars: Takei, Tsai, Shen and Landa, "A practical
path-planning algorithm for a simple car", 2010). Objects are not in it, so one table serves every
call on a map.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free
from pushplan.motion.goal_region import in_goal
from pushplan.search.grid_dijkstra import new_grid_search, settle_cells
from pushplan.world.checks import BoolArray, FloatArray, IntArray


class CostToGo(NamedTuple):
    """A table of lengths to the goal."""

    values: FloatArray
    """(rows, columns, headings) [m]; inf where the robot overlaps a wall or has no way"""
    floor: FloatArray
    """(rows, columns) [m] least length for the robot's inscribed disc, on the grid"""
    origin: FloatArray  # (2,) least x, y of the grid [m]
    cell: float  # Side of a cell [m]


@kernel(allocates=True)
def mark_free(
    table: CostToGo,
    free: BoolArray,  # (rows, columns, headings), changed in place
    first: int,  # cells, counted row by row
    last: int,
    shape: Footprint,
    walls: ConvexObstacles,
) -> None:
    """Mark which of the cells from ``first`` to ``last`` (exclusive) hold the footprint."""
    scratch = np.empty_like(shape.vertices)
    pose = np.empty(3)
    cols = free.shape[1]
    headings = free.shape[2]
    for at in range(first, last):
        r = at // cols
        c = at % cols
        pose[0] = table.origin[0] + (c + 0.5) * table.cell
        pose[1] = table.origin[1] + (r + 0.5) * table.cell
        for k in range(headings):
            pose[2] = 2.0 * np.pi * k / headings
            free[r, c, k] = is_free(pose, shape, walls, scratch)


@kernel(allocates=True)
def flood(
    table: CostToGo,
    open_cells: BoolArray,  # (rows, columns)
    goal: FloatArray,  # (5,) from `goal_numbers`
    center: IntArray,  # (2,) row and column of the goal's middle, negative for none
) -> tuple[FloatArray, IntArray]:
    """Grid lengths (rows, columns) [m] to the goal, and the cells in the order of their lengths."""
    origin = table.origin
    cell = table.cell
    rows, cols = open_cells.shape
    starts = np.empty(rows * cols + 1, np.int64)
    count = 0
    weights = np.full((rows, cols), np.inf)
    for at in range(rows * cols):
        r = at // cols
        c = at % cols
        if open_cells[r, c]:
            weights[r, c] = 1.0
        x = origin[0] + (c + 0.5) * cell
        y = origin[1] + (r + 0.5) * cell
        # a disc may be smaller than a cell
        if (open_cells[r, c] and in_goal(x, y, goal)) or (r == center[0] and c == center[1]):
            starts[count] = at
            count += 1
    none = np.zeros((rows, cols), np.bool_)
    search = new_grid_search(rows, cols, starts[:count])
    settle_cells(search, weights, none, cell, rows * cols)
    return search.costs, search.order[: search.counters[1]]


@kernel
def _between(
    values: FloatArray, ox: float, oy: float, cell: float, x: float, y: float, theta: float
) -> float:
    """Interpolated value at a pose; cells without a value do not count, inf if none has one."""
    rows, cols, headings = values.shape
    u = (x - ox) / cell - 0.5
    v = (y - oy) / cell - 0.5
    t = (theta / (2.0 * np.pi) * headings) % headings
    j = int(np.floor(u))
    i = int(np.floor(v))
    k = int(t)
    fu = u - j
    fv = v - i
    ft = t - k
    k = k % headings
    total = 0.0
    weight = 0.0
    for di in range(2):
        r = i + di
        if r < 0 or r >= rows:
            continue
        wi = fv if di == 1 else 1.0 - fv
        for dj in range(2):
            c = j + dj
            if c < 0 or c >= cols:
                continue
            wj = wi * (fu if dj == 1 else 1.0 - fu)
            for dk in range(2):
                w = wj * (ft if dk == 1 else 1.0 - ft)
                value = values[r, c, (k + dk) % headings]
                if w > 1e-9 and value < np.inf:
                    total += w * value
                    weight += w
    return total / weight if weight > 0.25 else np.inf


@kernel
def sweep(
    table: CostToGo,  # its values are changed in place
    free: BoolArray,  # (rows, columns, headings)
    order: IntArray,  # (N,) cells by their distance from the goal
    ends: FloatArray,  # (headings, arcs, 3) displacement at the end of each arc
    length: float,  # of the arcs [m]
) -> float:
    """One Gauss-Seidel sweep over the cells; returns the greatest change [m]."""
    values = table.values
    cell = table.cell
    cols = values.shape[1]
    headings = values.shape[2]
    change = 0.0
    ox = table.origin[0]
    oy = table.origin[1]
    for n in range(order.shape[0]):
        r = order[n] // cols
        c = order[n] % cols
        x = ox + (c + 0.5) * cell
        y = oy + (r + 0.5) * cell
        if table.floor[r, c] == 0.0:
            continue
        for k in range(headings):
            if not free[r, c, k]:
                continue
            best = values[r, c, k]
            for a in range(ends.shape[1]):
                nx = x + ends[k, a, 0]
                ny = y + ends[k, a, 1]
                nt = ends[k, a, 2]
                value = length + _between(values, ox, oy, cell, nx, ny, nt)
                if value < best:
                    best = value
            if best < values[r, c, k]:
                change = max(change, min(values[r, c, k], 1e9) - best)
                values[r, c, k] = best
    return change


@kernel
def length_to_go(table: CostToGo, x: float, y: float, theta: float) -> float:
    """Length to the goal [m] from a pose: the table's, or its floor where it has none."""
    value = _between(table.values, table.origin[0], table.origin[1], table.cell, x, y, theta)
    rows, cols = table.floor.shape
    r = min(max(int((y - table.origin[1]) / table.cell), 0), rows - 1)
    c = min(max(int((x - table.origin[0]) / table.cell), 0), cols - 1)
    if value == np.inf:
        value = table.floor[r, c]
    return value
