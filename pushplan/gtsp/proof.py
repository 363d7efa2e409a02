"""Lower bounds and proofs: walks with a short memory, then the few paths that they leave.

A tour of m clusters is a walk of m arcs from the root to the root. A walk may come to a cluster
twice, but not while it remembers it: at each cluster it knows those on a short list (the ng-route
relaxation of Baldacci, Mingozzi and Roberti 2011). Lagrangian prices of the clusters make walks
visit each about once; the cheapest walk less the prices is a lower bound (Held and Karp 1971).

The walks bound every tour. Those through one node bound the tours through it, so that
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
from pushplan.gtsp.problem import Padded, Problem, StopFired, asked, tour_cost
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
MARGIN = 1e-10
"""Fraction of the largest cost by which sums of floats may be off."""
CHUNK_ARCS = 2_000_000
"""Arcs that are looked at between two looks at the stop rule."""


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


class Walks:
    """Walks from one node of the root, through nodes that may be part of a cheaper tour."""

    def __init__(
        self,
        costs: FloatArray,  # (N, N), infinite inside of clusters
        node: int,  # of the root
        members: list[IntArray],  # nodes of each other cluster
        lists: IntArray,  # (n, n - 1) the other clusters by distance from each
        limit: float,  # only tours below this cost matter; may be infinite
        # asked every few milliseconds; `StopFired` is raised where it says so
        stopped: Callable[[], bool],
    ) -> None:
        finite = costs[np.isfinite(costs)]
        self.margin = MARGIN * float(np.abs(finite).max(initial=0.0))
        whole = bool((finite == np.round(finite)).all()) and self.margin < 0.25
        self.goal = limit
        self.limit = limit - (0.5 if whole else self.margin)
        self.node = node
        self.count = len(members)
        self.lists = lists
        self.prices = np.zeros(self.count)
        self.bound = -np.inf
        self.paths = 0  # looked at by `cheaper_tour`
        self._all = costs
        self._stopped = stopped
        self._gather(members)

    def _gather(self, members: list[IntArray]) -> None:
        """Costs between these nodes."""
        self.look()
        self.nodes = Padded.gather(self._all, members)
        self.width = self.nodes.names.shape[1]
        self.look()
        self.blocks = np.ascontiguousarray(self.nodes.costs.transpose(2, 3, 0, 1))  # to, from
        self.first = self.nodes.pick(self._all[self.node])
        self.last = self.nodes.pick(self._all[:, self.node])

    def look(self) -> None:
        """Ask the stop rule."""
        if self._stopped():
            raise StopFired

    def remember(self, bits: int) -> None:
        """Make walks know so many clusters of each list."""
        self.bits = bits
        self.known = np.ascontiguousarray(self.lists[:, :bits])
        bit = 1 << np.arange(bits)
        memories = np.arange(1 << bits)[:, None] & bit > 0
        holds = np.zeros((self.count, 1 << bits, self.count), dtype=bool)  # memory M of e holds d
        np.put_along_axis(holds, self.known[:, None], memories, 2)
        # moves[d, e, M]: new memory with cluster d before a walk from e, -1 where d is remembered
        self._moves = np.empty((self.count, self.count, 1 << bits), dtype=np.int64)
        for d, known in enumerate(self.known):
            new = holds[:, :, known]
            new[known, :, np.arange(bits)] = True
            self._moves[d] = np.where(holds[:, :, d], -1, new @ bit)
            self._moves[d, d] = -1
        self._empty()

    def _empty(self) -> None:
        # walks[k, d, M, i]: cheapest from node i of d over k more clusters to the root
        self.walks = np.empty((self.count, self.count, 1 << self.bits, self.width))

    def _longer(self, walks: FloatArray, longer: FloatArray, blocks: FloatArray) -> None:
        per_cluster = self.count * len(walks[0]) * self.width**2
        step = max(1, CHUNK_ARCS // per_cluster)
        sizes = self.nodes.sizes
        for low in range(0, self.count, step):
            high = min(low + step, self.count)
            core.extend_walks(walks, longer, blocks, self._moves, self.prices, sizes, low, high)
            self.look()

    def fill(self) -> None:
        """All walks to the root with the prices as they are."""
        self.walks[0] = np.inf
        self.walks[0, :, 0] = self.last
        for k in range(1, self.count):
            self._longer(self.walks[k - 1], self.walks[k], self.blocks)

    def ascend(self, steps: int) -> None:
        """Subgradient steps on the prices; leaves the best ones, and a table to be filled."""
        visits = np.zeros(self.count, dtype=np.int64)
        best = self.prices
        top = -np.inf
        scale = 1.0
        since = 0
        for _ in range(steps):
            self.fill()
            cost = core.read_visits(
                self.walks,
                self.first,
                self.blocks,
                self._moves,
                self.prices,
                self.nodes.sizes,
                visits,
            )
            value = float(self.prices.sum()) - self.margin + cost
            self.bound = max(self.bound, value)
            since += 1
            if value > top:
                top = value
                best = self.prices
                since = 0
            if since >= 4:
                scale = 0.5 * scale
                since = 0
                self.prices = best
            slope = 1.0 - visits
            norm = float(slope @ slope)
            if self.bound > self.limit or norm == 0.0 or not np.isfinite(value):
                break
            goal = self.goal
            if not np.isfinite(goal):  # no tour is known: aim well above the bound
                goal = value + abs(value) + self.margin
            self.prices = self.prices + scale * max(goal - value, 0.0) / norm * slope
        self.prices = best

    def thin(self) -> bool:
        """Leave out nodes that no walk below the limit comes to.

        Fills the table.

        Returns:
            True if every cluster has a node left.
        """
        self.fill()
        ahead = np.full_like(self.walks[0], np.inf)
        longer = np.empty_like(self.walks[0])
        ahead[:, 0] = self.first
        through = np.full(self.first.shape, np.inf)  # (n, K)
        for k in range(self.count):
            np.minimum(through, ahead.min(axis=1) + self.walks[-1 - k].min(axis=1), out=through)
            if k + 1 < self.count:
                self._longer(ahead, longer, self.nodes.costs)
                ahead, longer = longer, ahead
        keep = through + (self.prices.sum() - self.prices)[:, None] < self.limit
        if not keep.any(axis=1).all():
            return False
        if keep.sum() < self.nodes.sizes.sum():
            self._gather([row[kept] for row, kept in zip(self.nodes.names, keep, strict=True)])
            self._empty()
            self.fill()
        return True

    def allow_memories(self) -> None:
        """Turn the entry of every memory M into the least of those within M."""
        for walks in self.walks:
            for b in range(self.bits):
                halves = walks.reshape(self.count, -1, 2, 1 << b, self.width)  # without b, with it
                np.minimum(halves[:, :, 1], halves[:, :, 0], out=halves[:, :, 1])
            self.look()
