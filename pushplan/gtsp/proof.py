"""Lower bounds and proofs: walks with a short memory, then the few paths that they leave.

The walks of `walks` bound every tour. Those through one node bound the tours through it, so that
most nodes can be left out, which makes longer memories affordable. What is left goes to dynamic
programming over (clusters, last node), in which the walks bound what completes a path and only
paths stay that may end below the best tour. If none is left, that tour is optimal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.problem import Problem
from pushplan.gtsp.walk_kernels import PathProblem, Paths, extend_paths
from pushplan.gtsp.walks import CHUNK_ARCS, StopFired, Walks
from pushplan.world.checks import FloatArray, IntArray


def cheaper_tour(
    walks: Walks,  # filled; changed by `Walks.allow_memories`
    most: int,  # paths of one length at most
) -> tuple[bool, IntArray | None, int]:
    """The cheapest tour below the limit of the walks, by paths of more and more clusters.

    A path is known by its clusters and its last node. The walks bound what completes it.

    Returns:
        Whether the paths were few enough; the nodes of the tour, None if there is none; how many
        paths there were.
    """
    walks.allow_memories()
    paths, total = _first_paths(walks), 0
    trail = [(paths.ends, paths.parents)]
    slots = np.empty(1 << int(np.ceil(np.log2(2 * most))), dtype=np.int64)
    for k in range(walks.count - 2, -1, -1):
        slots[:] = -1
        longer = _longer(walks, paths, walks.walks[k], slots, most)
        if longer is None:
            return False, None, total
        paths = longer
        total += len(paths.ends)
        trail.append((paths.ends, paths.parents))
    costs = paths.values + walks.last.ravel()[paths.ends]
    if not len(costs) or not costs.min() < walks.limit:
        return True, None, total
    at, chosen = int(costs.argmin()), []
    for ends, parents in reversed(trail):
        chosen.append(walks.names.ravel()[ends[at]])
        at = int(parents[at])
    return True, np.array([walks.node, *chosen[::-1]], dtype=np.int64), total


def _room_for(size: int) -> Paths:
    """Memory for so many paths."""
    whole = np.empty((3, size), dtype=np.int64)
    real = np.empty((2, size))
    return Paths(whole[0], whole[1], real[0], real[1], whole[2])


def _only(paths: Paths, which: slice | NDArray[np.bool_]) -> Paths:
    """A copy of some of them."""
    return Paths._make(part[which].copy() for part in paths)


def _first_paths(walks: Walks) -> Paths:
    """From the root to one node."""
    ends = np.flatnonzero(walks.names.ravel() >= 0)
    cluster = ends // walks.width
    paths = _room_for(len(ends))
    paths.ends[:], paths.parents[:] = ends, 0
    paths.sets[:] = np.int64(1) << cluster
    paths.values[:] = walks.first.ravel()[ends]
    paths.rests[:] = walks.prices.sum() - walks.prices[cluster]
    hope = walks.walks[-1, :, -1].ravel()[ends]
    return _only(paths, paths.values + hope + paths.rests < walks.limit)


def _longer(
    walks: Walks, paths: Paths, within: FloatArray, slots: IntArray, most: int
) -> Paths | None:
    """All of them with one node more; None if they are too many."""
    problem = PathProblem(within, walks.costs, walks.known, walks.prices, walks.sizes, walks.limit)
    new, found = _room_for(most), 0
    step = max(1, CHUNK_ARCS // (4 * walks.count * walks.width))
    for low in range(0, len(paths.ends), step):
        high = min(low + step, len(paths.ends))
        found = extend_paths(problem, paths, low, high, slots, new, found)
        walks.look()
        if found < 0:
            return None
    return _only(new, slice(found))


MOST_CLUSTERS = 62
"""Besides the root: a path keeps its clusters in the bits of one number."""
LARGEST_TABLE = 30_000_000
MOST_ARCS = 600_000_000
"""Arcs that the walks of one price vector may look at."""
STAGES = ((0, 30), (3, 20), (4, 20), (6, 15), (8, 12), (9, 12))
"""Clusters that walks remember, and steps of the prices with it."""
FEW_PATHS = 4_000
"""Paths that are worth a try before walks remember more; doubles with each cluster remembered."""


@dataclass
class Proof:
    """What is known of the optimum."""

    bound: float = -np.inf  # no tour is cheaper, -inf if nothing is known
    complete: bool = False  # whether the best tour that is known is proven to be optimal
    nodes: IntArray | None = None  # a cheaper tour than the given one, if one was found
    detail: dict[str, float] = field(default_factory=dict)  # further numbers, by name


def prove(
    problem: Problem,  # with at least 4 clusters
    cost: float,  # of the best tour that is known; may be infinite
    stopped: Callable[[], bool],  # asked every few milliseconds
    config: GtspConfig,  # its ``proof_states``
) -> Proof:
    """A lower bound, and a proof where the paths are few enough."""
    result = Proof(np.inf, True, None, {"paths": 0.0})
    others = np.delete(np.arange(problem.count), problem.root)
    members = [np.arange(*problem.offsets[c : c + 2]) for c in others]
    near = problem.nearest(problem.count)[0][others]
    lists = near[near != problem.root].reshape(len(others), -1)  # numbers of all clusters
    lists -= lists > problem.root  # numbers of the others
    costs = worth_using(problem, cost)
    limit = cost
    for node in range(*problem.offsets[problem.root : problem.root + 2]):
        walks = Walks(costs, node, members, lists, limit, stopped)
        done, nodes, paths = False, None, 0
        try:
            done, nodes, paths = _settle(walks, config)
        except StopFired:
            pass
        result.detail["paths"] += paths
        if nodes is not None:
            result.nodes, limit = nodes, problem.path_cost(nodes)
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
    result = problem.outer
    for turned in (False, True):
        arcs = result.T if turned else result
        least = np.minimum.reduceat(arcs.min(axis=0), problem.offsets[:-1])
        spare = cost - math.fsum(least) + 1e-9 * (abs(cost) + math.fsum(np.abs(least)))
        arcs = np.where(arcs - least[problem.cluster_of] > spare, np.inf, arcs)
        result = arcs.T if turned else arcs
    return result


def _settle(walks: Walks, config: GtspConfig) -> tuple[bool, IntArray | None, int]:
    """Whether no tour below the limit is missed, the nodes of one if there is one, and paths."""
    total = 0
    for bits, steps in STAGES:
        bits = min(bits, walks.count - 1)
        numbers, arcs = walks.size_with(bits)
        if numbers > LARGEST_TABLE or arcs > MOST_ARCS:
            break
        walks.remember(bits)
        walks.ascend(steps)
        if walks.bound > walks.limit or not walks.thin():
            return True, None, total
        if bits and walks.count <= MOST_CLUSTERS:
            most = min(config.proof_states, FEW_PATHS << bits)
            done, nodes, paths = cheaper_tour(walks, most)
            total += paths
            if done:
                return True, nodes, total
    return False, None, total
