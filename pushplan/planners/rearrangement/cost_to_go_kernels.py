"""The cheapest order of pushes that delivers everything, exactly, for few objects."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray

MAX_OBJECTS = 62
"""Number of objects that a set in one machine word can hold."""
MAX_EXACT = 11
"""Up to so many objects every completion is computed exactly."""


@kernel(allocates=True)
def cost_to_go(
    costs: FloatArray,  # (N + 1, N) of each push after each other one, the last row after the start
    masks: IntArray,  # (N,) what each push delivers, one bit an object
    objects: int,  # at most `MAX_EXACT`
) -> tuple[FloatArray, IntArray]:
    """(2**objects, N + 1) cost of delivering the rest by set and last push; the push to follow."""
    # backward dynamic programming over sets (Held and Karp 1962), with pushes in the place of
    # cities and sets that may grow by several objects at once; -1 follows where nothing helps
    count = masks.shape[0]
    every = (1 << objects) - 1
    best = np.empty((every + 1, count + 1))
    following = np.empty((every + 1, count + 1), dtype=np.int64)
    best[:] = np.inf
    following[:] = -1
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
