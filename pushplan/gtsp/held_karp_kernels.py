"""Exact dynamic programming over subsets of clusters and the node that was reached last."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.world.checks import FloatArray, IntArray


@kernel
def fill_subsets(
    low: int,  # at least 1
    high: int,
    table: FloatArray,  # (2^m, m, K), filled up to ``low``
    blocks: FloatArray,  # (m, K, m, K) cost from node i of c to node j of d, infinite padding
    sizes: IntArray,  # (m,) nodes of each cluster
    first: FloatArray,  # (m, K) cost from the root to each node
) -> None:
    """Fill the subsets ``low`` to ``high - 1`` (Held and Karp 1962, over clusters)."""
    # table[S, c, j]: cost of the cheapest path from the root through one node of every cluster in S
    # (a bit mask) that ends in node j of cluster c; subsets come before what holds them
    count, width = first.shape
    for subset in range(low, high):
        for d in range(count):
            if not (subset >> d) & 1:
                continue
            out = table[subset, d]
            rest = subset ^ (1 << d)
            if rest == 0:
                copy_into(out, first[d])
                continue
            out[:] = np.inf
            for c in range(count):
                if (rest >> c) & 1:
                    _relax(table[rest, c], blocks[c, :, d], sizes[c], out, width)


@kernel
def _relax(values: FloatArray, block: FloatArray, size: int, out: FloatArray, width: int) -> None:
    """``out = min(out, values + block)`` over the rows of a block, four at a time."""
    i = 0
    while i + 3 < size:
        a, b, c, d = values[i], values[i + 1], values[i + 2], values[i + 3]
        row_a, row_b, row_c, row_d = block[i], block[i + 1], block[i + 2], block[i + 3]
        for j in range(width):
            x = min(a + row_a[j], b + row_b[j])
            y = min(c + row_c[j], d + row_d[j])
            out[j] = min(out[j], min(x, y))
        i += 4
    while i < size:
        a = values[i]
        row_a = block[i]
        for j in range(width):
            out[j] = min(out[j], a + row_a[j])
        i += 1


@kernel
def read_path(
    table: FloatArray,  # (2^m, m, K)
    blocks: FloatArray,  # (m, K, m, K)
    sizes: IntArray,  # (m,)
    last: FloatArray,  # (m, K) cost from each node back to the root
    path: IntArray,  # (m,) filled with ``cluster * K + node``
) -> float:
    """The cost of the cheapest closed tour in a filled table; ``path`` in visiting order."""
    count, width = last.shape
    subset = (1 << count) - 1
    best, at = np.inf, -1
    for c in range(count):
        for j in range(sizes[c]):
            x = table[subset, c, j] + last[c, j]
            if x < best:
                best, at = x, c * width + j
    if at < 0:
        return best
    for i in range(count - 1, -1, -1):
        path[i] = at
        d, j = at // width, at % width
        value = table[subset, d, j]
        subset ^= 1 << d
        at = -1
        for c in range(count):
            if not (subset >> c) & 1:
                continue
            for k in range(sizes[c]):
                if at < 0 and table[subset, c, k] + blocks[c, k, d, j] == value:
                    at = c * width + k
    return best
