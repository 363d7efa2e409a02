"""Optimal tours of small instances by dynamic programming, a few milliseconds at a time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.gtsp.held_karp_kernels import fill_subsets, read_path
from pushplan.gtsp.problem import Problem
from pushplan.world.checks import IntArray

ARCS_PER_SECOND = 1.5e9
"""How many arcs the kernel looks at, on a slow machine."""


def table_mb(problem: Problem) -> float:
    """Memory of the table [MB]."""
    free = problem.count - 1
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
