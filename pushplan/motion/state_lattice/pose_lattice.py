"""`PoseLattice`: places and headings joined by motion primitives, which cost what they cover."""

from __future__ import annotations

from typing import NamedTuple

from pushplan.world.checks import FloatArray, IntArray


class PoseLattice(NamedTuple):
    """A lattice of H headings over rows ahead and columns across it.

    Node (h, u, v) has the number (h * rows + u) * columns + v. Lengths are in metres and places in
    steps, unless stated otherwise; costs are in metres of travel.
    """

    rows: int
    columns: int
    step: float  # Distance of neighbouring places [m]
    cells: int  # Cells of the map in a step
    corner: IntArray  # (2,) cell of the map on which the node of row 0 and column 0 lies
    first: IntArray  # (H + 1,) where the primitives of each heading start
    ends: IntArray  # (P, 3) rows, columns [steps] and heading at the end of each primitive
    lengths: FloatArray  # (P,) [m]
    boxes: FloatArray
    """(P, 4) least and greatest row and column of the robot's origin along each primitive."""
    run_first: IntArray  # (P + 1,) where the runs of each primitive start
    runs: IntArray
    """(R, 2) first cell and last cell + 1 of the cells that it newly covers, in columns, as offsets
    in the flattened sums below; the map is so large that no swath leaves it."""
    cost_sums: FloatArray
    """(map columns * (map rows + 1),) sums of the costs of each column before each row [m]."""
    blocked_sums: FloatArray
    """The same for cells that must not be covered; (0,) where there are none."""
    stride: int  # Map rows + 1
    planes: FloatArray  # (B, 3) a, b, c: the robot's origin keeps a u + b v <= c [steps]
    goal: FloatArray
    """(4,) 0 and the row of the goal line; or 1, row, column and radius of the goal disc."""
    row_bounds: FloatArray  # (H, rows) length of the path from each row and heading to the line [m]
    place_costs: FloatArray
    """(rows, columns) bound or estimate of the cost from each place to the line [m]."""
    inflation: float  # Factor on both
