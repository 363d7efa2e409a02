"""The cost of what is covered from each place of a lattice to a goal line.

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

from pushplan.core import motion as core
from pushplan.world.checks import FloatArray, IntArray

LEAN = 0.3
"""Angle φ [rad] of the bound of a length by its parts ahead and across, a cos φ + b sin φ."""


class HullWindow(NamedTuple):
    """Cells that a robot is assumed to cover where it crosses a row of cells."""

    half: int  # Cells to each side of the one below its origin
    reach: int  # Distance ahead of the origin in which it may cover cells already [cells]
    along: int  # Rows to each side over which costs are averaged; 0 for a bound
    stage: int  # Rows from one that is looked at to the next; 1 for a bound
    factor: float  # Factor on costs; at most 1 for a bound
    cell: float  # Side of a cell [m]
    lean: float  # Angle φ [rad]


def place_costs(
    sums: FloatArray,  # (map columns, map rows + 1) costs of each column before each row [m]
    places: IntArray,  # (U,) row of the map on which each row of the lattice lies
    goal_cell: int,  # row of the map on which the goal line lies, or one before
    columns: IntArray,  # (V,) columns of the map on which those of the lattice lie
    between: tuple[int, int],  # first and last column of the map where the origin may be
    window: HullWindow,
) -> FloatArray:
    """(U, V) cost [m] from each place of a lattice to a goal line, at least or about; 0 beyond."""
    costs = np.empty((len(places), len(columns)))
    core.place_costs(sums, places, goal_cell, columns, between, *window, costs)
    return costs
