"""An instance as the core wants it: nodes of a cluster side by side, useless ones left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.core import gtsp as core
from pushplan.gtsp.checking import row_pieces
from pushplan.gtsp.distances import Distances
from pushplan.world.checks import FloatArray, IntArray


class StopFired(Exception):
    """The stop rule has fired."""


@dataclass(frozen=True)
class Problem:
    """Costs with the nodes ordered by clusters."""

    costs: FloatArray  # (N, N) float64; inf forbids an arc. Arcs inside a cluster mean nothing.
    offsets: IntArray  # (m + 1,) cluster c has the nodes ``offsets[c]`` to ``offsets[c + 1] - 1``
    names: IntArray  # (N,) what the caller calls each node
    forbidden: float | None = None  # `penalty` if it is that of a problem with more nodes
    # asked every few milliseconds; `StopFired` is raised where it says so
    stopped: Callable[[], bool] = lambda: False

    @staticmethod
    def build(
        costs: NDArray[np.number] | Distances,
        members: Sequence[IntArray],
        stopped: Callable[[], bool],
    ) -> Problem:
        """Gather the members of each cluster; what is in order is not copied."""
        names = np.concatenate(members)
        offsets = np.concatenate(([0], np.cumsum([len(nodes) for nodes in members])))
        whole = len(names) == len(costs) and bool((names == np.arange(len(names))).all())
        if whole and isinstance(costs, np.ndarray) and costs.dtype == np.float64:
            gathered = np.ascontiguousarray(costs)
        else:
            gathered = np.empty((len(names), len(names)))
            for rows in asked(gathered, stopped):
                gathered[rows] = costs[np.ix_(names[rows], names)]
        places = offsets.astype(np.int64)
        return Problem(gathered, places, names.astype(np.int64), stopped=stopped)

    def reduced(self) -> Problem:
        """The same without nodes that another one of their cluster can always stand for."""
        needed = np.ones(len(self.costs), np.int64)
        if self.width == 1:
            return self
        core.mark_needed(self.costs, np.ascontiguousarray(self.costs.T), self.offsets, needed)
        if needed.all():
            return self
        return self.only(np.flatnonzero(needed))

    def only(self, kept: IntArray) -> Problem:
        """The same with some nodes, (k,) ascending, at least one of each cluster."""
        costs = self.costs[np.ix_(kept, kept)]
        offsets = np.searchsorted(kept, self.offsets)
        return Problem(costs, offsets, self.names[kept], self.penalty, self.stopped)

    @property
    def count(self) -> int:
        """Number of clusters."""
        return len(self.offsets) - 1

    @property
    def width(self) -> int:
        """Nodes of the largest cluster."""
        return int(np.diff(self.offsets).max())

    @property
    def root(self) -> int:
        """The smallest cluster."""
        return int(np.argmin(np.diff(self.offsets)))

    @property
    def members(self) -> list[IntArray]:
        """The nodes of each cluster."""
        return np.split(np.arange(len(self.costs)), self.offsets[1:-1])

    @cached_property
    def cluster_of(self) -> IntArray:
        """(N,) the cluster of each node."""
        return np.repeat(np.arange(self.count), np.diff(self.offsets))

    def _outer_rows(self) -> Iterator[tuple[slice, FloatArray]]:
        """A few rows at a time of the costs, infinite inside of clusters, and which they are."""
        for rows in asked(self.costs, self.stopped):
            some = self.costs[rows].copy()
            some[self.cluster_of[rows, None] == self.cluster_of] = np.inf
            yield rows, some

    def outer(self) -> FloatArray:
        """(N, N) costs, infinite inside of clusters."""
        result = np.empty_like(self.costs)
        for rows, some in self._outer_rows():
            result[rows] = some
        return result

    @cached_property
    def penalty(self) -> float:
        """Cost of a forbidden arc, which no tour over finite arcs reaches."""
        if self.forbidden is not None:
            return self.forbidden
        low = np.inf
        high = -np.inf
        for _, some in self._outer_rows():
            known = np.isfinite(some)
            low = min(low, some.min())
            high = max(high, some.max(where=known, initial=-np.inf))
        if high == -np.inf:
            low = 0.0
            high = 1.0
        return float(high + (self.count + 1) * (high - low) + (abs(high) or 1.0))

    @cached_property
    def finite(self) -> FloatArray:
        """(N, N + SPARE) costs; a forbidden arc costs `penalty`."""
        wide = np.full((len(self.costs), len(self.costs) + core.SPARE), self.penalty)
        for rows in asked(self.costs, self.stopped):
            some = self.costs[rows]
            wide[rows, : -core.SPARE] = np.where(np.isfinite(some), some, self.penalty)
        return wide

    @cached_property
    def reverse(self) -> FloatArray:
        """(N, N + SPARE) the same of the transposed costs."""
        if self.symmetric:
            return self.finite
        wide = np.full_like(self.finite, self.finite[0, -1])
        for rows in asked(self.costs, self.stopped):
            wide[rows, : -core.SPARE] = self.finite[:, rows].T
        return wide

    @cached_property
    def into(self) -> FloatArray:
        """(m, N) cheapest arc from each cluster to each node."""
        return self._cheapest(self.finite)

    @cached_property
    def onto(self) -> FloatArray:
        """(m, N) cheapest arc from each node to each cluster."""
        if self.symmetric:
            return self.into
        return self._cheapest(self.reverse)

    def _cheapest(self, wide: FloatArray) -> FloatArray:
        least = np.full((self.count, len(self.costs)), np.inf)
        for rows in asked(self.costs, self.stopped):
            self._lower(least, rows, wide[rows, : -core.SPARE])
        return least

    def _lower(self, least: FloatArray, rows: slice, some: FloatArray) -> None:
        """Note what some rows say of the least value in each cluster of rows."""
        clusters = slice(self.cluster_of[rows.start], self.cluster_of[rows.stop - 1] + 1)
        starts = np.maximum(self.offsets[:-1][clusters], rows.start) - rows.start
        found = np.minimum.reduceat(some, starts, axis=0)
        np.minimum(least[clusters], found, out=least[clusters])

    @cached_property
    def symmetric(self) -> bool:
        """True if every arc costs the same in both directions."""
        costs = self.costs
        pieces = asked(costs, self.stopped)
        return all(np.array_equal(costs[rows], costs[:, rows].T) for rows in pieces)

    @cached_property
    def _least(self) -> tuple[FloatArray, FloatArray]:
        """(N,) the cheapest arc into each node from another cluster, and out of it to one."""
        into = np.full(len(self.costs), np.inf)
        out = np.empty(len(self.costs))
        for rows, some in self._outer_rows():
            np.minimum(into, some.min(axis=0), out=into)
            out[rows] = some.min(axis=1)
        return into, out

    @cached_property
    def floor(self) -> float:
        """No tour is cheaper: into every cluster by its cheapest arc, or out of it."""
        into, out = (np.minimum.reduceat(arcs, self.offsets[:-1]) for arcs in self._least)
        return max(math.fsum(into), math.fsum(out))  # rounded once, as the cost of a tour is

    def nearest(self, most: int) -> tuple[IntArray, FloatArray]:
        """(m, k) nearest clusters of each and their distances: reduced costs, the cheaper way.

        The column minima, then the row minima are taken off, as a cost of its own that every arc
        into a node has says nothing about which cluster is near.
        """
        into = _known(self._least[0])
        between = np.full((self.count, self.count), np.inf)
        for rows, some in self._outer_rows():
            some -= into
            some -= _known(some.min(axis=1))[:, None]
            self._lower(between, rows, np.minimum.reduceat(some, self.offsets[:-1], axis=1))
        between = np.minimum(between, between.T)
        np.fill_diagonal(between, np.inf)
        near = np.empty((self.count, min(most, self.count - 1)), dtype=np.int64)
        for rows in asked(between, self.stopped):
            order = np.argsort(between[rows], axis=1, kind="stable")
            others = order != np.arange(self.count)[rows, None]
            near[rows] = order[others].reshape(len(order), -1)[:, :most]
        return near, np.ascontiguousarray(np.take_along_axis(between, near, 1))


def asked(costs: NDArray[np.number], stopped: Callable[[], bool]) -> Iterator[slice]:
    """Yield `row_pieces`; `StopFired` is raised where the stop rule, asked before each, fires."""
    for rows in row_pieces(costs):
        if stopped():
            raise StopFired
        yield rows


def tour_cost(costs: NDArray[np.number] | Distances, nodes: IntArray) -> float:
    """Cost of a closed tour: the sum of its arcs, rounded once; 0 for a single node."""
    if len(nodes) < 2:
        return 0.0
    arcs = costs[nodes, np.append(nodes[1:], nodes[0])]
    if np.isinf(arcs).any():
        return math.inf
    return math.fsum(arcs.tolist())


def _known(values: FloatArray) -> FloatArray:
    return np.where(np.isfinite(values), values, 0.0)


def usable(
    costs: NDArray[np.number] | Distances,  # (N, N)
    members: Sequence[IntArray],  # nodes of each cluster
    stopped: Callable[[], bool],  # `StopFired` is raised where it says so
) -> list[IntArray]:
    """The members of each cluster without nodes that no tour can enter or leave."""
    if not isinstance(costs, np.ndarray) or costs.dtype.kind != "f":
        return list(members)
    if all(costs[rows].max() < np.inf for rows in asked(costs, stopped)):
        return list(members)
    arcs = np.isfinite(costs)
    for nodes in members:
        arcs[np.ix_(nodes, nodes)] = False
    active = np.ones(len(costs), dtype=bool)
    while True:
        gone = active & ~(arcs.any(axis=0) & arcs.any(axis=1))
        if stopped():
            raise StopFired
        if not gone.any():
            return [nodes[active[nodes]] for nodes in members]
        arcs[gone] = False
        arcs[:, gone] = False
        active &= ~gone


class Padded(NamedTuple):
    """Clusters as rows of K nodes, the shorter ones padded."""

    names: IntArray  # (n, K) number of each node, -1 where there is none
    sizes: IntArray  # (n,) nodes of each cluster
    costs: FloatArray  # (n, K, n, K) from node i of c to node j of d, infinite where there is none

    @staticmethod
    def gather(costs: FloatArray, members: Sequence[IntArray]) -> Padded:
        """Take these nodes out of (N, N) costs."""
        sizes = np.array([len(nodes) for nodes in members], dtype=np.int64)
        names = np.full((len(members), int(sizes.max())), -1, dtype=np.int64)
        names[np.arange(names.shape[1]) < sizes[:, None]] = np.concatenate(members)
        flat = names.ravel()
        between = costs[np.ix_(flat, flat)]
        between[flat < 0] = np.inf
        between[:, flat < 0] = np.inf
        return Padded(names, sizes, between.reshape(names.shape * 2))

    def pick(self, values: FloatArray) -> FloatArray:
        """(n, K) what (N,) values say of each node, infinite where there is none."""
        return np.where(self.names < 0, np.inf, values[self.names])
