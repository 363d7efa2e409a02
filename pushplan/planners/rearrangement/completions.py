"""The cheapest order of pushes that covers everything, exactly, for few objects."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray

MOST = 62
"""How many objects a set in one machine word can hold."""
EXACT = 11
"""Up to so many objects every completion is computed exactly."""


@kernel(allocates=True)
def completions(costs: FloatArray, masks: IntArray, boxes: int) -> tuple[FloatArray, IntArray]:
    """What it costs to cover the rest, from every set covered so far and every last push.

    Backward dynamic programming over sets (Held and Karp 1962), with pushes in the place of cities
    and sets that may grow by several objects at once.

    Args:
        costs: (N + 1, N) cost of each push after each other one, the last row after the start.
        masks: (N,) what each push covers, one bit an object.
        boxes: how many objects there are, at most `EXACT`.

    Returns:
        (2**boxes, N + 1) costs, and the push that comes next, -1 at the end or where nothing helps.
    """
    count = masks.shape[0]
    every = (1 << boxes) - 1
    best = np.full((every + 1, count + 1), np.inf)
    following = np.full((every + 1, count + 1), -1, dtype=np.int64)
    best[every] = 0.0
    for mask in range(every - 1, -1, -1):
        for last in range(count + 1):
            if last == count:
                if mask:
                    continue
            elif masks[last] & ~mask:
                continue
            for q in range(count):
                new = masks[q] | mask
                if new == mask:
                    continue
                total = costs[last, q] + best[new, q]
                if total < best[mask, last]:
                    best[mask, last] = total
                    following[mask, last] = q
    return best, following
