"""Instances with more nodes than a search should hold: promising nodes, and all of them at last."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pushplan.world.checks import FloatArray, IntArray

NEAREST = 5
"""How many of the nearest clusters say how promising a node is."""


def promising(
    costs: NDArray[np.number],  # (N, N)
    members: Sequence[IntArray],  # nodes of each cluster
    most: int,  # nodes in all, but at least one of each cluster
    # asked between clusters; what is not yet looked at keeps its order
    stopped: Callable[[], bool],
) -> list[IntArray]:
    """The nodes of each cluster with the cheapest arcs from and to its nearest clusters.

    Returns:
        The nodes that are kept.
    """
    count = len(members)
    each = max(1, most // count)
    into, out = np.full((NEAREST, len(costs)), np.inf), np.full((NEAREST, len(costs)), np.inf)
    for nodes in members:
        if stopped():
            break
        _merge(into, costs[nodes].min(axis=0), nodes)
        _merge(out, costs[:, nodes].min(axis=1), nodes)
    score = _total(into) + _total(out)
    return [np.sort(nodes[np.argsort(score[nodes], kind="stable")[:each]]) for nodes in members]


def _merge(best: FloatArray, values: NDArray[np.number], own: IntArray) -> None:
    """Keep the least values of each column in ``best``, in ascending order."""
    new = values.astype(np.float64)
    new[own] = np.inf
    for row in best:
        lower, new = np.minimum(row, new), np.maximum(row, new)
        row[:] = lower


def _total(best: FloatArray) -> FloatArray:
    """Sums of what is finite, infinite where nothing is."""
    total = np.where(np.isfinite(best), best, 0.0).sum(axis=0)
    return np.where(np.isfinite(best[0]), total, np.inf)


def best_choice(
    costs: NDArray[np.number],  # (N, N)
    layers: Sequence[IntArray],  # nodes of each cluster in visiting order, at least 2 clusters
) -> IntArray:
    """The cheapest nodes for a closed order of clusters, on costs that are not gathered.

    Returns:
        A node of each.
    """
    values: FloatArray = np.full((len(layers[0]), len(layers[0])), np.inf)  # (root, node)
    np.fill_diagonal(values, 0.0)
    picks: list[IntArray] = []
    for here, there in zip(layers, [*layers[1:], layers[0]], strict=True):
        arcs = costs[np.ix_(here, there)].astype(np.float64)  # (here, there)
        pick = np.empty((len(values), len(there)), dtype=np.int64)
        following = np.empty((len(values), len(there)))
        for root, row in enumerate(values):
            total = row[:, None] + arcs
            pick[root] = total.argmin(axis=0)
            following[root] = np.take_along_axis(total, pick[root][None], 0)[0]
        picks.append(pick)
        values = following
    root = int(np.diag(values).argmin())
    at, chosen = root, []
    for pick, nodes in zip(reversed(picks), reversed(layers), strict=True):
        at = int(pick[root, at])
        chosen.append(nodes[at])
    return np.array(chosen[::-1], dtype=np.int64)
