"""The cost of what is covered from each place of a lattice to a goal line, compiled.

A path crosses every row of cells up to the line, and where its origin does so, the robot covers at
least a window as wide as its inscribed disc. So the cost is at least that of the best sequence of
such windows, one in each row, plus the length of the path that joins them. Of that length only
a cos φ + b sin φ counts, for a metres ahead and b across, which is never more than it: rounding the
crossings to cells lengthens b no further if they may be off by one cell.

That bound dodges floes as no hull can. Averaging the costs along the path over the length of the
hull takes this out: an estimate that is no bound, but guides a search much better.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray

LEAN = 0.3
"""Angle φ [rad] of the bound of a length by its parts ahead and across, a cos φ + b sin φ."""


@kernel
def _drift(values: FloatArray, first: int, last: int, cost: float) -> None:
    """Let each value be reached from the others at ``cost`` for each cell across."""
    for i in range(first + 1, last + 1):
        values[i] = min(values[i], values[i - 1] + cost)
    for i in range(last - 1, first - 1, -1):
        values[i] = min(values[i], values[i + 1] + cost)


class HullWindow(NamedTuple):
    """Cells that a robot is assumed to cover where it crosses a row of cells."""

    half: int  # Cells to each side of the one below its origin
    reach: int  # Distance ahead of the origin in which it may cover cells already [cells]
    along: int  # Rows to each side over which costs are averaged; 0 for a bound
    stage: int  # Rows from one that is looked at to the next; 1 for a bound
    factor: float  # Factor on costs; at most 1 for a bound
    cell: float  # Side of a cell [m]
    lean: float  # Angle φ [rad]


@kernel(allocates=True)
def place_costs(
    sums: FloatArray,  # (map columns, map rows + 1) costs of each column before each row [m]
    places: IntArray,  # (U,) row of the map on which each row of the lattice lies
    goal_cell: int,  # row of the map on which the goal line lies, or one before
    columns: IntArray,  # (V,) columns of the map on which those of the lattice lie
    between: tuple[int, int],  # first and last column of the map where the origin may be
    window: HullWindow,
) -> FloatArray:
    """(U, V) cost [m] from each place of a lattice to a goal line, at least or about; 0 beyond."""
    width = sums.shape[0]
    rows = sums.shape[1] - 1
    first, last = between
    half = window.half
    along = window.along
    ahead = window.cell * np.cos(window.lean)
    scale = window.factor * window.stage / (2 * along + 1)
    across = window.cell * np.sin(window.lean)
    costs = np.zeros((places.shape[0], columns.shape[0]))
    values = np.zeros(width)
    near = np.empty(width)
    line = np.empty(width)
    u = places.shape[0] - 1
    for row in range(min(goal_cell, rows) - 1, -1, -window.stage):
        # ``values``: from each column of the last row, with what is covered there
        while u >= 0 and min(places[u] + window.reach, goal_cell - 1) >= row:
            near[:] = values
            _drift(near, first, last, across)
            gap = goal_cell - places[u]
            for v in range(columns.shape[0]):
                if gap > 0:
                    column = min(max(columns[v], first), last)
                    costs[u, v] = near[column] + ahead * min(window.reach + 1, gap)
            u -= 1
        _drift(values, first, last, across)
        low = max(row - along, 0)
        high = min(row + along + 1, rows)
        for column in range(max(first - half, 0), min(last + half + 1, width)):
            line[column] = scale * (sums[column, high] - sums[column, low])
        total = 0.0
        for column in range(max(first - half, 0), min(first + half, width)):
            total += line[column]
        for column in range(first, last + 1):
            if column + half < width:
                total += line[column + half]
            if column - half - 1 >= 0 and column > first:
                total -= line[column - half - 1]
            # sliding sums lose digits, a bound must not
            values[column] += window.stage * ahead + max(total - 1e-9 * abs(total) - 1e-12, 0.0)
    return costs
