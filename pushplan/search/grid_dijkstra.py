"""Dijkstra's algorithm over the cells of a grid with eight neighbours each, compiled.

It serves the coarse path of the navigation planners and the floor of the push-aware planner's
cost-to-go. Three searches stay apart. `geometry.visibility.relax` runs over a graph of bends, not
over a grid. The distance fields of `geometry.distance_field` are exact: no cell depends on
another. The search over poses of `planners.rearrangement.pose_search` has headings, costs that
depend on both ends of a move, and so many poses that buckets take the place of the heap.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.search.heap import pop_least, push_or_lift
from pushplan.world.checks import BoolArray, FloatArray, IntArray


@kernel(allocates=True)
def grid_dijkstra(
    weights: FloatArray,  # (rows, columns) cost per metre of a move into each cell, inf: closed
    starts: IntArray,  # cells, counted row by row
    goals: BoolArray,  # (rows, columns)
    cell: float,  # side of a cell [m]
) -> tuple[FloatArray, IntArray, IntArray]:
    """Costs (rows, columns), parents, and settled cells in order, the first goal last; -1: none."""
    rows, cols = weights.shape
    costs = np.full((rows, cols), np.inf)
    parents = np.full(rows * cols, -1, np.int64)
    order = np.empty(rows * cols, np.int64)
    keys, heap = np.empty(rows * cols), np.empty(rows * cols, np.int64)
    places, size = np.full(rows * cols, -1, np.int64), np.zeros(1, np.int64)
    for at in starts:
        costs[at // cols, at % cols] = 0.0
        push_or_lift(keys, heap, places, size, at, 0.0)
    settled = 0
    while size[0] > 0:
        at = pop_least(keys, heap, places, size)
        r, c = at // cols, at % cols
        order[settled] = at
        settled += 1
        if goals[r, c]:
            break
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                nr, nc = r + dr, c + dc
                if nr < 0 or nc < 0 or nr >= rows or nc >= cols or np.isinf(weights[nr, nc]):
                    continue
                length = cell * np.sqrt(float(dr * dr + dc * dc))
                cost = costs[r, c] + length * weights[nr, nc]
                if cost < costs[nr, nc]:
                    costs[nr, nc] = cost
                    parents[nr * cols + nc] = at
                    push_or_lift(keys, heap, places, size, nr * cols + nc, cost)
    return costs, parents, order[:settled]
