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

from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.paths import cheaper_tour
from pushplan.gtsp.problem import Problem
from pushplan.gtsp.walks import Stopped, Walks
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
        except Stopped:
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
