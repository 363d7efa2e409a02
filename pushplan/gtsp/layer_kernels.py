"""Shortest paths through the layers of a tour, kept up to date while clusters come and go.

``ahead[c, v]`` is the cost of the cheapest path from the root's node along the tour to node v of
cluster c, ``behind[c, v]`` of that from there to the root. A change moves all values past it by
what the tour costs more. That amount is carried by the cluster beside the change instead
(both its values are lowered by ``carry[c]``), so that only a few values have to be renewed, up to
where they agree with the old ones; and in every gap of the tour the cheapest path across costs 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.gtsp.node_choice_kernels import SPARE, pull_values, push_values
from pushplan.world.checks import FloatArray, IntArray

NARROW = 3
"""Clusters of fewer nodes are entered along the rows of the transpose."""


class Layers(NamedTuple):
    """A tour and its values; m clusters of at most K nodes."""

    costs: FloatArray  # (N, N + SPARE)
    reverse: FloatArray  # (N, N + SPARE) of the transpose
    at: IntArray  # (m,) first node of each cluster; of the root, the node that counts
    size: IntArray  # (m,) nodes of each cluster; 1 for the root
    after: IntArray  # (m,) next cluster
    before: IntArray  # (m,) previous cluster
    ahead: FloatArray  # (m, K)
    behind: FloatArray  # (m, K)
    carry: FloatArray  # (m,)
    least: FloatArray  # (m, 2) the least of ``ahead`` and of ``behind``
    into: FloatArray  # (m, N) cheapest arc from a cluster to a node
    onto: FloatArray  # (m, N) cheapest arc from a node to a cluster
    old_links: IntArray  # (m, 2) what ``after`` and ``before`` were when the round began
    old_ahead: FloatArray  # (m, K)
    old_behind: FloatArray  # (m, K)
    old_carry: FloatArray  # (m,)
    old_least: FloatArray  # (m, 2)
    stamp: IntArray  # (m,) round in which a cluster was touched last
    touched: IntArray  # (m + 1,) how many clusters the round has touched, and which
    out: FloatArray  # (K + SPARE,) working memory, as the next two
    left: FloatArray
    right: FloatArray


@kernel(allocates=True)
def make_layers(
    costs: FloatArray,
    reverse: FloatArray,
    into: FloatArray,
    onto: FloatArray,
    offsets: IntArray,
    root: int,
) -> Layers:
    """Memory for a search."""
    count = len(offsets) - 1
    size = offsets[1:] - offsets[:-1]
    width = np.max(size)
    size[root] = 1
    return Layers(
        costs,
        reverse,
        offsets[:-1].copy(),
        size,
        np.empty(count, np.int64),
        np.empty(count, np.int64),
        np.empty((count, width)),
        np.empty((count, width)),
        np.zeros(count),
        np.zeros((count, 2)),
        into,
        onto,
        np.empty((count, 2), np.int64),
        np.empty((count, width)),
        np.empty((count, width)),
        np.empty(count),
        np.empty((count, 2)),
        np.full(count, -1, np.int64),
        np.zeros(count + 1, np.int64),
        np.empty(width + SPARE),
        np.empty(width + SPARE),
        np.empty(width + SPARE),
    )


@kernel
def build(tour: Layers, order: IntArray, root_node: int) -> float:
    """Compute all values of a closed tour from scratch; returns its cost."""
    count = len(order)
    root = order[0]
    tour.at[root] = root_node
    tour.carry[:] = 0.0
    for p in range(count):
        c = order[p]
        d = order[p + 1 if p + 1 < count else 0]
        tour.after[c] = d
        tour.before[d] = c
    tour.ahead[root, 0] = 0.0
    for p in range(1, count):
        c = order[p]
        _from(tour, True, order[p - 1], c, tour.out)
        for v in range(tour.size[c]):
            tour.ahead[c, v] = tour.out[v]
    _from(tour, True, order[count - 1], root, tour.out)
    total = tour.out[0]
    tour.behind[root, 0] = -total
    tour.least[root, 0] = 0.0
    tour.least[root, 1] = -total
    for p in range(count - 1, 0, -1):
        c = order[p]
        d = order[p + 1 if p + 1 < count else 0]
        _from(tour, False, d, c, tour.out)
        for v in range(tour.size[c]):
            tour.behind[c, v] = tour.out[v]
        _note_least(tour, c)
    return float(total)


@kernel(inline=True)
def _note_least(tour: Layers, c: int) -> None:
    """Bring ``least`` of a cluster up to date."""
    ahead = behind = np.inf
    for v in range(tour.size[c]):
        ahead = min(ahead, tour.ahead[c, v])
        behind = min(behind, tour.behind[c, v])
    tour.least[c, 0] = ahead
    tour.least[c, 1] = behind


@kernel(inline=True)
def _from(tour: Layers, forward: bool, a: int, b: int, out: FloatArray) -> None:
    """Fill ``out`` with the values of cluster b from those of cluster a, one way or the other."""
    values = tour.ahead if forward else tour.behind
    n_at = tour.size[a]
    n_to = tour.size[b]
    if n_to < NARROW and n_at > n_to:  # along the rows of the transpose, which lie in a piece
        other = tour.reverse if forward else tour.costs
        pull_values(other, values, a, tour.at[a], n_at, tour.at[b], n_to, out)
    else:
        costs = tour.costs if forward else tour.reverse
        push_values(costs, values, a, tour.at[a], n_at, tour.at[b], n_to, out)


@kernel(inline=True)
def keep(tour: Layers, c: int, now: int) -> None:
    """Save a cluster as it is, once in a round."""
    if tour.stamp[c] != now:
        tour.stamp[c] = now
        tour.touched[0] += 1
        tour.touched[tour.touched[0]] = c
        tour.old_links[c, 0] = tour.after[c]
        tour.old_links[c, 1] = tour.before[c]
        tour.old_carry[c] = tour.carry[c]
        tour.old_least[c, 0] = tour.least[c, 0]
        tour.old_least[c, 1] = tour.least[c, 1]
        for v in range(tour.size[c]):
            tour.old_ahead[c, v] = tour.ahead[c, v]
            tour.old_behind[c, v] = tour.behind[c, v]


@kernel(inline=True)
def undo(tour: Layers) -> None:
    """Put back what `keep` has saved in this round."""
    for i in range(1, tour.touched[0] + 1):
        c = tour.touched[i]
        tour.after[c] = tour.old_links[c, 0]
        tour.before[c] = tour.old_links[c, 1]
        tour.carry[c] = tour.old_carry[c]
        tour.least[c, 0] = tour.old_least[c, 0]
        tour.least[c, 1] = tour.old_least[c, 1]
        for v in range(tour.size[c]):
            tour.ahead[c, v] = tour.old_ahead[c, v]
            tour.behind[c, v] = tour.old_behind[c, v]


@kernel(inline=True)
def _renew(tour: Layers, forward: bool, c: int, root: int, now: int, tolerance: float) -> None:
    """Renew the values past cluster c in one direction, up to where they are as they were."""
    values, onward = (tour.ahead, tour.after) if forward else (tour.behind, tour.before)
    p = c
    c = onward[c]
    out = tour.out
    while c != root:
        _from(tour, forward, p, c, out)
        changed = False
        least = np.inf
        for v in range(tour.size[c]):
            out[v] -= tour.carry[c]
            least = min(least, out[v])
            changed = changed or abs(out[v] - values[c, v]) > tolerance
        if not changed:
            return
        keep(tour, c, now)
        tour.least[c, 0 if forward else 1] = least
        for v in range(tour.size[c]):
            values[c, v] = out[v]
        p = c
        c = onward[c]


@kernel(inline=True)
def _renew_both(tour: Layers, c: int, root: int, now: int, tolerance: float) -> None:
    """Renew the values on both sides of cluster c, which have changed too."""
    _note_least(tour, c)
    _renew(tour, True, c, root, now, tolerance)
    _renew(tour, False, c, root, now, tolerance)


@kernel(inline=True)
def close_gap(
    tour: Layers,
    a: int,
    b: int,
    carried: float,  # sum of ``carry`` of the clusters that were between them
    root: int,
    now: int,  # number of the round
    tolerance: float,  # of values that count as equal
) -> float:
    """Link cluster a to b, what was between them being gone; returns the change of cost."""
    keep(tour, a, now)
    keep(tour, b, now)
    tour.after[a] = b
    tour.before[b] = a
    out = tour.out
    _from(tour, True, a, b, out)
    cost = np.inf
    for v in range(tour.size[b]):
        cost = min(cost, out[v] + tour.behind[b, v])
    if a != root:
        tour.carry[a] += cost
        _from(tour, False, b, a, out)
        for v in range(tour.size[a]):
            tour.ahead[a, v] -= cost
            tour.behind[a, v] = out[v] - tour.carry[a]
        _renew_both(tour, a, root, now, tolerance)
    else:
        tour.carry[b] += cost
        for v in range(tour.size[b]):
            tour.ahead[b, v] = out[v] - tour.carry[b]
            tour.behind[b, v] -= cost
        _renew_both(tour, b, root, now, tolerance)
    return float(cost - carried)


@kernel(inline=True)
def insertion_cost(tour: Layers, c: int, a: int, b: int, limit: float) -> float:
    """Return the increase in the tour's cost with cluster c between a and b.

    Infinite where a lower bound says that it is not below the limit.
    """
    at = tour.at[c]
    size = tour.size[c]
    start = tour.least[a, 0]
    end = tour.least[b, 1]
    bound = np.inf
    for v in range(at, at + size):
        bound = min(bound, tour.into[a, v] + tour.onto[b, v])
    if start + bound + end >= limit:
        return np.inf
    left = tour.left
    right = tour.right
    _from(tour, True, a, c, left)
    bound = np.inf
    for v in range(size):
        bound = min(bound, left[v] + tour.onto[b, at + v])
    if bound + end >= limit:
        return np.inf
    _from(tour, False, b, c, right)
    cost = np.inf
    for v in range(size):
        cost = min(cost, left[v] + right[v])
    return float(cost)


@kernel(inline=True)
def link_in(tour: Layers, c: int, a: int, root: int, now: int, tolerance: float) -> float:
    """Put cluster c behind cluster a; returns the change of the tour's cost."""
    b = tour.after[a]
    cost = insertion_cost(tour, c, a, b, np.inf)
    keep(tour, a, now)
    keep(tour, b, now)
    tour.after[a] = c
    tour.before[c] = a
    tour.after[c] = b
    tour.before[b] = c
    tour.carry[c] = cost
    for v in range(tour.size[c]):
        tour.ahead[c, v] = tour.left[v] - cost
        tour.behind[c, v] = tour.right[v] - cost
    _renew_both(tour, c, root, now, tolerance)
    return float(cost)
