"""Nodes that no tour needs, because another node of their cluster costs no more in any place."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray

EFFORT = 16
"""Comparisons for each pair of nodes, after which all nodes that are left count as needed."""


@kernel
def mark_needed(
    costs: FloatArray,  # (N, N); inf forbids an arc, arcs inside a cluster mean nothing
    reverse: FloatArray,  # (N, N) the transpose
    offsets: IntArray,  # (m + 1,) first node of each cluster
    needed: IntArray,  # (N,) ones; 0 is written where another node does as well
) -> None:
    """Find nodes whose arcs cost as much as those of another node of their cluster, or more.

    Of nodes that cost the same the last is kept.
    """
    left = EFFORT * len(costs) ** 2
    for c in range(len(offsets) - 1):
        low = offsets[c]
        high = offsets[c + 1]
        for v in range(low, high):
            for u in range(low, high):
                if u == v or not needed[u]:
                    continue
                same = _agrees_until(costs, u, v, low, high)
                left -= same
                if same == len(costs):
                    same = _agrees_until(reverse, u, v, low, high)
                    left -= same
                if left < 0:
                    return
                if same == len(costs):
                    needed[v] = 0
                    break


@kernel
def _agrees_until(costs: FloatArray, u: int, v: int, low: int, high: int) -> int:
    """First node outside the cluster to which u costs more than v; how many there are if none."""
    for w in range(low):
        if costs[u, w] > costs[v, w]:
            return w
    for w in range(high, len(costs)):
        if costs[u, w] > costs[v, w]:
            return w
    return len(costs)


def needed_nodes(costs: FloatArray, offsets: IntArray) -> IntArray:
    """(k,) the nodes that are left, at least one of each cluster."""
    needed = np.ones(len(costs), np.int64)
    mark_needed(costs, np.ascontiguousarray(costs.T), offsets, needed)
    return np.flatnonzero(needed)
