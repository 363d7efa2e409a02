"""Compiled parts that every search shares: random numbers and the best nodes for an order.

Nodes are numbered so that those of a cluster follow one another: cluster c has the nodes
``offsets[c]`` to ``offsets[c + 1]``. ``costs`` is (N, N + SPARE) float64, what is past the last
node means nothing; ``reverse`` holds its transpose.
"""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray

SPARE = 3
"""Columns that the matrices of a search have past the last node, see `push_values`."""


@kernel(inline=True)
def draw(state: IntArray) -> float:
    """A number in [0, 1) from a xorshift64* generator (Vigna 2016); ``state`` is (1,) uint64."""
    x = state[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    state[0] = x
    high = (x * np.uint64(2685821657736338717)) >> np.uint64(11)
    return float(high) * (1.0 / 9007199254740992.0)


@kernel(inline=True)
def below(state: IntArray, count: int) -> int:
    """A whole number from 0 to ``count - 1``."""
    return int(draw(state) * count)


@kernel(inline=True)
def push_values(
    costs: FloatArray,  # (N, N + SPARE); up to `SPARE` columns past the cluster are read
    values: FloatArray,  # (m, >= n_at)
    a: int,  # row of ``values``
    at: int,  # first node of the cluster that the path comes from
    n_at: int,
    to: int,  # first node of the cluster that it goes to
    n_to: int,
    out: FloatArray,  # (>= n_to + SPARE,) what is past ``n_to`` means nothing
) -> None:
    """Fill ``out[w] = min_v values[a, v] + costs[at + v, to + w]``, four columns at a time."""
    for w in range(0, n_to, 4):
        first = second = third = fourth = np.inf
        j = to + w
        for v in range(n_at):
            x = values[a, v]
            i = at + v
            first = min(first, x + costs[i, j])
            second = min(second, x + costs[i, j + 1])
            third = min(third, x + costs[i, j + 2])
            fourth = min(fourth, x + costs[i, j + 3])
        out[w] = first
        out[w + 1] = second
        out[w + 2] = third
        out[w + 3] = fourth


@kernel(inline=True)
def pull_values(
    reverse: FloatArray,  # (N, N + SPARE); up to `SPARE` columns past the cluster are read
    values: FloatArray,  # (m, >= n_at)
    a: int,  # row of ``values``
    at: int,  # first node of the cluster that the path comes from
    n_at: int,
    to: int,  # first node of the cluster that it goes to
    n_to: int,
    out: FloatArray,  # (>= n_to,)
) -> None:
    """Fill ``out[w] = min_v values[a, v] + reverse[to + w, at + v]``, row by row."""
    whole = n_at - n_at % 4
    for w in range(n_to):
        first = second = third = fourth = np.inf
        i = to + w
        for v in range(0, whole, 4):
            j = at + v
            first = min(first, values[a, v] + reverse[i, j])
            second = min(second, values[a, v + 1] + reverse[i, j + 1])
            third = min(third, values[a, v + 2] + reverse[i, j + 2])
            fourth = min(fourth, values[a, v + 3] + reverse[i, j + 3])
        for v in range(whole, n_at):
            first = min(first, values[a, v] + reverse[i, at + v])
        out[w] = min(min(first, second), min(third, fourth))


@kernel
def best_nodes(
    costs: FloatArray,  # (N, N + SPARE)
    offsets: IntArray,  # (m + 1,)
    order: IntArray,  # (>= count,) clusters in visiting order
    count: int,  # number of them, at least 2
    nodes: IntArray,  # (>= count,) filled with the chosen nodes
    layers: FloatArray,  # (>= count, K + SPARE) working memory
) -> float:
    """Fill the cheapest nodes for a closed order of clusters; returns its cost (Fischetti 1997)."""
    # a shortest path through the layers for every node of ``order[0]``, which should be small
    root = order[0]
    last = order[count - 1]
    a = offsets[last]
    z = offsets[last + 1]
    best = np.inf
    for node in range(offsets[root], offsets[root + 1]):
        at = offsets[order[1]]
        size = offsets[order[1] + 1] - at
        for v in range(size):
            layers[1, v] = costs[node, at + v]
        for i in range(2, count):
            to = offsets[order[i]]
            n_to = offsets[order[i] + 1] - to
            push_values(costs, layers, i - 1, at, size, to, n_to, layers[i])
            at = to
            size = n_to
        cost = np.inf
        end = -1
        for v in range(a, z):
            x = layers[count - 1, v - a] + costs[v, node]
            if x < cost:
                cost = x
                end = v
        if cost < best:
            best = cost
            nodes[0] = node
            nodes[count - 1] = end
            for i in range(count - 1, 1, -1):
                to = nodes[i]
                before = offsets[order[i - 1]]
                value = layers[i, to - offsets[order[i]]]
                pick = before
                for v in range(before, offsets[order[i - 1] + 1]):
                    if layers[i - 1, v - before] + costs[v, to] == value:
                        pick = v
                        break
                nodes[i - 1] = pick
    return best
