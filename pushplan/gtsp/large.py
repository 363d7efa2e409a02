"""Instances with more nodes than a search should hold: promising nodes, and all of them at last."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pushplan.gtsp.distances import Distances
from pushplan.world.checks import IntArray

NEAREST = 5
"""Number of nearest clusters by which the promise of a node is judged."""


def promising(
    costs: NDArray[np.number] | Distances,  # (N, N)
    members: Sequence[IntArray],  # nodes of each cluster
    most: int,  # nodes in all, but at least one of each cluster
    # asked between clusters; what is not yet looked at keeps its order
    stopped: Callable[[], bool],
) -> list[IntArray]:
    """The nodes of each cluster with the cheapest arcs from and to its nearest clusters.

    Returns:
        The nodes that are kept.
    """
    score = np.zeros(len(costs))
    for arcs in (costs, costs.T):
        nearest = np.full((NEAREST, len(costs)), np.inf)  # cheapest arcs with clusters, ascending
        for nodes in members:
            if stopped():
                break
            arc = arcs[nodes].min(axis=0).astype(np.float64)
            arc[nodes] = np.inf
            for row in nearest:
                lower = np.minimum(row, arc)
                arc = np.maximum(row, arc)
                row[:] = lower
        total = np.where(np.isfinite(nearest), nearest, 0.0).sum(axis=0)
        score += np.where(np.isfinite(nearest[0]), total, np.inf)
    each = max(1, most // len(members))
    return [np.sort(nodes[np.argsort(score[nodes], kind="stable")[:each]]) for nodes in members]


def best_choice(
    costs: NDArray[np.number] | Distances,  # (N, N)
    layers: Sequence[IntArray],  # nodes of each cluster in visiting order, at least 2 clusters
    stopped: Callable[[], bool],  # asked between clusters
) -> IntArray | None:
    """The cheapest nodes for a closed order of clusters, on costs that are not gathered.

    Returns:
        A node of each; None if it was stopped.
    """
    values = np.where(np.eye(len(layers[0])) > 0.0, 0.0, np.inf)  # (root, node)
    picks: list[IntArray] = []
    for here, there in zip(layers, [*layers[1:], layers[0]], strict=True):
        if stopped():
            return None
        arcs = costs[np.ix_(here, there)]
        pick = (values[:, :, None] + arcs).argmin(axis=1)  # (root, there)
        values = np.take_along_axis(values, pick, 1) + arcs[pick, np.arange(len(there))]
        picks.append(pick)
    at = root = int(np.diag(values).argmin())
    chosen = []
    for pick, nodes in zip(reversed(picks), reversed(layers), strict=True):
        at = int(pick[root, at])
        chosen.append(nodes[at])
    return np.array(chosen[::-1], dtype=np.int64)
