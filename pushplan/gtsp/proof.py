"""Lower bounds and proofs: walks with a short memory, then the few paths that they leave.

The walks of `walks` bound every tour. Those through one node bound the tours through it, so that
most nodes can be left out, which makes longer memories affordable. What is left goes to dynamic
programming over (clusters, last node), in which the walks bound what completes a path and only
paths stay that may end below the best tour. If none is left, that tour is optimal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.core import gtsp as core
from pushplan.gtsp.problem import Problem, StopFired, asked, tour_cost
from pushplan.gtsp.walks import CHUNK_ARCS, Walks
from pushplan.world.checks import FloatArray, IntArray

MOST_CLUSTERS = 62
"""Besides the root: a path keeps its clusters in the bits of one number."""
LARGEST_TABLE = 30_000_000
MOST_ARCS = 600_000_000
"""Arcs that the walks of one price vector may look at."""
STAGES = ((0, 30), (3, 20), (4, 20), (6, 15), (8, 12), (9, 12))
"""Clusters that walks remember, and steps of the prices with it."""
FEW_PATHS = 4_000
"""Paths that are worth a try before walks remember more; doubles with each cluster remembered."""


class Paths(NamedTuple):
    """Partial tours of one length."""

    sets: IntArray  # (P,) clusters of each path as a bit mask
    ends: IntArray  # (P,) its last node, ``d * K + i``
    values: FloatArray  # (P,) its cost
    rests: FloatArray  # (P,) sum of the prices of the clusters that it lacks
    parents: IntArray  # (P,) the path that it comes from


@dataclass
class Proof:
    """Proven facts about the optimum."""

    bound: float = np.inf  # no tour is cheaper, -inf if nothing is known
    complete: bool = True  # the best tour that is known is proven to be optimal
    nodes: IntArray | None = None  # a cheaper tour than the given one, if one was found
    paths: int = 0  # looked at


def prove(
    problem: Problem,  # with at least 4 clusters
    cost: float,  # of the best tour that is known; may be infinite
    stopped: Callable[[], bool],  # asked every few milliseconds
    most: int,  # paths of one length at most
) -> Proof:
    """A lower bound, and a proof where the paths are few enough.

    `StopFired` is raised where the stop rule fires before either has begun.
    """
    result = Proof()
    members = problem.members
    roots = members.pop(problem.root)
    near = np.delete(problem.nearest(problem.count)[0], problem.root, axis=0)
    lists = near[near != problem.root].reshape(len(members), -1)  # numbers of all clusters
    lists -= lists > problem.root  # numbers of the others
    costs = worth_using(problem, cost)
    limit = cost
    for root in roots:
        walks = Walks(costs, root, members, lists, limit, stopped)
        try:
            done, nodes = _settle(walks, most)
        except StopFired:
            done = False
            nodes = None
        result.paths += walks.paths
        if nodes is not None:
            result.nodes = nodes
            limit = tour_cost(problem.costs, nodes)
        result.bound = min(result.bound, min(walks.limit, limit) if done else walks.bound)
        result.complete = result.complete and done
        if result.bound == -np.inf:  # it cannot get better
            break
    return result


def worth_using(problem: Problem, cost: float) -> FloatArray:
    """(N, N) costs, infinite where an arc cannot be part of a tour below this cost.

    Every tour comes into each cluster and goes out of it; an arc may cost no more than the cheapest
    arc there and what the tour may cost above all cheapest arcs. This keeps a large number that
    stands for a forbidden arc from spoiling the margins of rounding.
    """
    result = problem.outer()
    for _ in ("into", "out of"):
        least = np.minimum.reduceat(result.min(axis=0), problem.offsets[:-1])
        spare = cost - math.fsum(least) + 1e-9 * (abs(cost) + math.fsum(np.abs(least)))
        for rows in asked(result, problem.stopped):
            some = result[rows]
            some[some - least[problem.cluster_of] > spare] = np.inf
        result = result.T
    return result


def _settle(walks: Walks, most: int) -> tuple[bool, IntArray | None]:
    """True if no tour below the limit is missed, and the nodes of one if there is one."""
    for bits, steps in STAGES:
        bits = min(bits, walks.count - 1)
        numbers = walks.count**2 * 2.0**bits * walks.width
        if numbers > LARGEST_TABLE or numbers * walks.count * walks.width > MOST_ARCS:
            break
        walks.remember(bits)
        walks.ascend(steps)
        if walks.bound > walks.limit or not walks.thin():
            return True, None
        if bits and walks.count <= MOST_CLUSTERS:
            done, nodes = cheaper_tour(walks, min(most, FEW_PATHS << bits))
            if done:
                return True, nodes
    return False, None


def cheaper_tour(
    walks: Walks,  # filled; changed by `Walks.allow_memories`
    most: int,  # paths of one length at most
) -> tuple[bool, IntArray | None]:
    """The cheapest tour below the limit of the walks, by paths of more and more clusters.

    A path is known by its clusters and its last node. The walks bound what completes it.

    Returns:
        True if the paths were few enough; the nodes of the tour, None if there is none.
    """
    walks.allow_memories()
    names, sizes, costs = walks.nodes
    ends = np.flatnonzero(names >= 0)
    clusters = ends // walks.width
    first = Paths(
        np.int64(1) << clusters,
        ends,
        walks.first.ravel()[ends],
        walks.prices.sum() - walks.prices[clusters],
        np.zeros(len(ends), dtype=np.int64),
    )
    hope = walks.walks[-1, :, -1].ravel()[ends]
    worth = first.values + hope + first.rests < walks.limit
    paths = Paths._make(part[worth] for part in first)
    trail = [(paths.ends, paths.parents)]
    slots = np.empty(1 << int(np.ceil(np.log2(2 * most))), dtype=np.int64)
    step = max(1, CHUNK_ARCS // (4 * walks.count * walks.width))
    for within in walks.walks[-2::-1]:
        bounds = (within, costs, walks.known, walks.prices, sizes, walks.limit)
        longer = Paths._make(np.empty(most, dtype=part.dtype) for part in paths)
        found = 0
        slots[:] = -1
        for low in range(0, len(paths.ends), step):
            high = min(low + step, len(paths.ends))
            found = core.extend_paths(*bounds, paths, low, high, slots, longer, found)
            walks.look()
            if found < 0:
                return False, None
        paths = Paths._make(part[:found] for part in longer)
        trail.append((paths.ends, paths.parents))
        walks.paths += found
    totals = paths.values + walks.last.ravel()[paths.ends]
    if not totals.min(initial=np.inf) < walks.limit:
        return True, None
    at = int(totals.argmin())
    chosen = [walks.node]
    for ends, parents in reversed(trail):
        chosen.insert(1, names.ravel()[ends[at]])
        at = int(parents[at])
    return True, np.array(chosen, dtype=np.int64)
