"""Relaxed tours: walks from one node of the root through every other cluster once on average.

A tour of m clusters is a walk of m arcs from the root to the root. A walk may come to a cluster
twice, but not while it remembers it: at each cluster it knows those on a short list (the ng-route
relaxation of Baldacci, Mingozzi and Roberti 2011). Lagrangian prices of the clusters make walks
visit each about once; the cheapest walk less the prices is a lower bound (Held and Karp 1971).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.core import gtsp as core
from pushplan.gtsp.problem import Padded, StopFired
from pushplan.world.checks import FloatArray, IntArray

MARGIN = 1e-10
"""Fraction of the largest cost by which sums of floats may be off."""
CHUNK_ARCS = 2_000_000
"""Arcs that are looked at between two looks at the stop rule."""


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
