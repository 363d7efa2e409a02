"""Optimal tours of small instances by dynamic programming, a few milliseconds at a time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.core import gtsp as core
from pushplan.gtsp.problem import Padded, Problem
from pushplan.world.checks import FloatArray, IntArray

ARCS_PER_SECOND = 1.5e9
"""Number of arcs that the core looks at in a second, on a slow machine."""


def table_mb(problem: Problem) -> float:
    """Memory of the table [MB], of up to a thousand clusters: more need no smaller one."""
    free = min(problem.count - 1, 1000)  # a float holds no power of two beyond 1023
    return 2.0**free * free * problem.width * 8.0 / 1e6


def expected_seconds(problem: Problem) -> float:
    """About how long it takes [s]."""
    free = problem.count - 1
    width = problem.width
    roots = int(np.diff(problem.offsets).min())
    return roots * free * max(free - 1, 1) * 2.0 ** (free - 2) * width**2 / ARCS_PER_SECOND


def solve_exactly(
    problem: Problem,  # with at least 2 clusters
    stopped: Callable[[], bool],  # asked about every ``chunk_s``
    chunk_s: float,  # [s]
) -> tuple[bool, IntArray | None]:
    """The cheapest tour.

    Returns:
        True if it got to its end, and the nodes in visiting order; None if no tour is finite or it
        was stopped.
    """
    others = problem.members
    roots = others.pop(problem.root)
    padded = Padded.gather(problem.costs, others)
    subsets = 1 << len(others)
    table = np.empty((subsets, *padded.names.shape))
    step = max(1, int(chunk_s / max(expected_seconds(problem) / subsets, 1e-9)))
    best = np.inf
    nodes = None
    for root in roots:
        first = padded.pick(problem.costs[root])
        for low in range(1, subsets, step):
            if stopped():
                return False, None
            high = min(low + step, subsets)
            core.fill_subsets(low, high, table, padded.costs, padded.sizes, first)
        ends = table[-1] + padded.pick(problem.costs[:, root])
        if ends.min() < best:
            best = ends.min()
            nodes = np.array([root, *_path_to(int(ends.argmin()), table, padded)])
    return True, nodes


def _path_to(end: int, table: FloatArray, padded: Padded) -> list[int]:
    """The nodes of the cheapest path to a node of a filled table, ``cluster * K + node``."""
    left = list(range(len(padded.sizes)))
    subset = len(table) - 1
    path: list[int] = []
    while left:
        c, i = divmod(end, table.shape[2])
        path.append(padded.names[left[c], i])
        d = left.pop(c)
        value = table[subset, d, i]
        subset ^= 1 << d
        before = table[subset, left] + padded.costs[left, :, d, i]  # (clusters that are left, K)
        end = int((before == value).argmax()) if left else -1
    return path[::-1]
