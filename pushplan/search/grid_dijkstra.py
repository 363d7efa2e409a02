"""Dijkstra's algorithm over the cells of a grid with eight neighbours each.

It serves the coarse path of the navigation planners, in the core, and the floor of the push-aware
planner's cost-to-go. Three searches stay apart. `relax` of the core runs over a graph of bends, not
over a grid. The distance fields of `geometry.distance_field` are exact: no cell depends on
another. The search over poses of `planners.rearrangement.pose_search` has headings, costs that
depend on both ends of a move, and so many poses that buckets take the place of the heap.
"""

from __future__ import annotations

from collections.abc import Callable

from pushplan.core import search as core
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_PIECE = 8_000  # cells between two looks at the stop rule: about 2 ms


def grid_dijkstra(
    weights: FloatArray,  # (rows, columns) cost per metre of a move into each cell, inf: closed
    starts: IntArray,  # cells, counted row by row
    goals: BoolArray,  # (rows, columns)
    cell: float,  # side of a cell [m]
    stopped: Callable[[], bool] = lambda: False,  # ends the search, asked every few milliseconds
) -> tuple[FloatArray, IntArray, IntArray]:
    """Costs (rows, columns), parents, and settled cells in order, the first goal last; -1: none."""
    search = core.GridDijkstra(weights, cell, starts)
    upto = _PIECE
    while search.settle(goals, upto) and not stopped():
        upto += _PIECE
    return search.costs, search.parents, search.order
