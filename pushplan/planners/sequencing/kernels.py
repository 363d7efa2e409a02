"""Compiled parts that every search shares: random numbers and the best nodes for an order.

Nodes are numbered so that those of a cluster follow one another: cluster c has the nodes
``offsets[c]`` to ``offsets[c + 1]``. ``costs`` is (N, N) float64, ``reverse`` its transpose.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pushplan.world.checks import FloatArray, IntArray

jit = njit(cache=True, nogil=True)


@jit
def draw(state: IntArray) -> float:
    """A number in [0, 1) from a xorshift64* generator (Vigna 2016); ``state`` is (1,) uint64."""
    x = state[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    state[0] = x
    high = (x * np.uint64(2685821657736338717)) >> np.uint64(11)
    return float(high) * (1.0 / 9007199254740992.0)


@jit
def below(state: IntArray, count: int) -> int:
    """A whole number from 0 to ``count - 1``."""
    return int(draw(state) * count)


@jit
def push_layer(
    costs: FloatArray, values: FloatArray, at: int, n_at: int, to: int, n_to: int, out: FloatArray
) -> None:
    """``out[w] = min_v values[v] + costs[at + v, to + w]``: one step of a layered shortest path."""
    row = costs[at, to : to + n_to]
    head = values[0]
    for w in range(n_to):
        out[w] = head + row[w]
    v = 1
    while v + 1 < n_at:
        first, second = values[v], values[v + 1]
        row, below_it = costs[at + v, to : to + n_to], costs[at + v + 1, to : to + n_to]
        for w in range(n_to):
            x = min(first + row[w], second + below_it[w])
            out[w] = min(x, out[w])
        v += 2
    if v < n_at:
        head = values[v]
        row = costs[at + v, to : to + n_to]
        for w in range(n_to):
            out[w] = min(head + row[w], out[w])


@jit
def best_nodes(
    costs: FloatArray,
    offsets: IntArray,
    order: IntArray,
    count: int,
    nodes: IntArray,
    layers: FloatArray,
) -> float:
    """The cheapest choice of nodes for a closed order of clusters (Fischetti et al. 1997).

    A shortest path through the layers for every node of ``order[0]``, which should be small.

    Args:
        costs: (N, N).
        offsets: (m + 1,).
        order: (>= count,) clusters in visiting order.
        count: how many of them, at least 2.
        nodes: (>= count,) filled with the chosen nodes.
        layers: (>= count, K) working memory.

    Returns:
        The cost of the closed tour.
    """
    root, last = order[0], order[count - 1]
    a, z = offsets[last], offsets[last + 1]
    best = np.inf
    for node in range(offsets[root], offsets[root + 1]):
        at = offsets[order[1]]
        size = offsets[order[1] + 1] - at
        layers[1, :size] = costs[node, at : at + size]
        for i in range(2, count):
            to = offsets[order[i]]
            n_to = offsets[order[i] + 1] - to
            push_layer(costs, layers[i - 1], at, size, to, n_to, layers[i])
            at, size = to, n_to
        cost, end = np.inf, -1
        for v in range(a, z):
            x = layers[count - 1, v - a] + costs[v, node]
            if x < cost:
                cost, end = x, v
        if cost < best:
            best = cost
            nodes[0] = node
            nodes[count - 1] = end
            for i in range(count - 1, 1, -1):
                to, before = nodes[i], offsets[order[i - 1]]
                value = layers[i, to - offsets[order[i]]]
                pick = before
                for v in range(before, offsets[order[i - 1] + 1]):
                    if layers[i - 1, v - before] + costs[v, to] == value:
                        pick = v
                        break
                nodes[i - 1] = pick
    return best
