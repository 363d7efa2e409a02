"""Optimal tours of small instances by dynamic programming, a few milliseconds at a time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.gtsp.problem import Problem
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


ARCS_PER_SECOND = 1.5e9
"""How many arcs the kernel looks at, on a slow machine."""


def table_mb(problem: Problem) -> float:
    """Memory of the table [MB], of up to a thousand clusters: more need no smaller one."""
    free = min(problem.count - 1, 1000)  # a float holds no power of two beyond 1023
    return 2.0**free * free * problem.width * 8.0 / 1e6


def expected_seconds(problem: Problem) -> float:
    """About how long it takes [s]."""
    free, width = problem.count - 1, problem.width
    roots = int(np.diff(problem.offsets).min())
    return roots * free * max(free - 1, 1) * 2.0 ** (free - 2) * width**2 / ARCS_PER_SECOND


def solve_exactly(
    problem: Problem,  # with at least 2 clusters
    stopped: Callable[[], bool],  # asked about every ``chunk_s``
    chunk_s: float,  # [s]
) -> tuple[bool, IntArray | None]:
    """The cheapest tour.

    Returns:
        Whether it got to its end, and the nodes in visiting order; None if no tour is finite or it
        was stopped.
    """
    root = problem.root
    others = [c for c in range(problem.count) if c != root]
    free, width = len(others), problem.width
    spans = [slice(*problem.offsets[c : c + 2]) for c in others]
    sizes = np.array([span.stop - span.start for span in spans], dtype=np.int64)
    blocks = np.full((free, width, free, width), np.inf)
    for c, rows in enumerate(spans):
        for d, columns in enumerate(spans):
            if c != d:
                blocks[c, : sizes[c], d, : sizes[d]] = problem.costs[rows, columns]
    first, last = np.full((free, width), np.inf), np.full((free, width), np.inf)
    table = np.empty((1 << free, free, width))
    path = np.empty(free, dtype=np.int64)
    per_subset = max(expected_seconds(problem) / 2.0**free, 1e-9)
    step = max(1, int(chunk_s / per_subset))
    best, nodes = np.inf, None
    for node in range(*problem.offsets[root : root + 2]):
        for c, span in enumerate(spans):
            first[c, : sizes[c]] = problem.costs[node, span]
            last[c, : sizes[c]] = problem.costs[span, node]
        for low in range(1, 1 << free, step):
            if stopped():
                return False, None
            high = min(low + step, 1 << free)
            fill_subsets(low, high, table, blocks, sizes, first)
        cost = read_path(table, blocks, sizes, last, path)
        if cost < best:
            best = cost
            starts = problem.offsets[np.array(others)[path // width]]
            nodes = np.concatenate(([node], starts + path % width))
    return True, nodes
