"""Dijkstra's algorithm over the cells of a grid with eight neighbours each, compiled.

It serves the coarse path of the navigation planners and the floor of the push-aware planner's
cost-to-go. Three searches stay apart. `relax` of the core runs over a graph of bends, not
over a grid. The distance fields of `geometry.distance_field` are exact: no cell depends on
another. The search over poses of `planners.rearrangement.pose_search` has headings, costs that
depend on both ends of a move, and so many poses that buckets take the place of the heap.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.core import search as core
from pushplan.search.heap import pop_least, push_or_lift
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_PIECE = 8_000  # cells between two looks at the stop rule: about 2 ms


class GridSearch(NamedTuple):
    """A search that has settled some cells, and its memory."""

    costs: FloatArray  # (rows, columns)
    parents: IntArray  # (cells,) as the next four; -1: none
    order: IntArray  # settled cells
    keys: FloatArray
    heap: IntArray
    places: IntArray
    counters: IntArray  # (2,) size of the heap, cells settled


@kernel(allocates=True)
def new_grid_search(rows: int, cols: int, starts: IntArray) -> GridSearch:
    """A search that begins at cells ``starts`` (S,), counted row by row."""
    costs = np.full((rows, cols), np.inf)
    counters = np.zeros(2, np.int64)
    parents = np.full(rows * cols, -1, np.int64)
    places = np.full(rows * cols, -1, np.int64)
    order = np.empty(rows * cols, np.int64)
    heap = np.empty(rows * cols, np.int64)
    keys = np.empty(rows * cols)
    for at in starts:
        costs[at // cols, at % cols] = 0.0
        push_or_lift(keys, heap, places, counters, at, 0.0)
    return GridSearch(costs, parents, order, keys, heap, places, counters)


@kernel
def settle_cells(
    search: GridSearch,  # changed in place
    weights: FloatArray,  # as in `grid_dijkstra`
    goals: BoolArray,
    cell: float,
    upto: int,  # cells settled in all
) -> bool:
    """Go on; False when a goal or all cells are settled."""
    costs, parents, order, keys, heap, places, counters = search
    rows, cols = weights.shape
    while counters[0] > 0 and counters[1] < upto:
        at = pop_least(keys, heap, places, counters)
        r = at // cols
        c = at % cols
        order[counters[1]] = at
        counters[1] += 1
        if goals[r, c]:
            return False
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                nr = r + dr
                nc = c + dc
                if nr < 0 or nc < 0 or nr >= rows or nc >= cols or np.isinf(weights[nr, nc]):
                    continue
                length = cell * np.sqrt(float(dr * dr + dc * dc))
                cost = costs[r, c] + length * weights[nr, nc]
                if cost < costs[nr, nc]:
                    costs[nr, nc] = cost
                    parents[nr * cols + nc] = at
                    push_or_lift(keys, heap, places, counters, nr * cols + nc, cost)
    return bool(counters[0] > 0)


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
