"""An instance as the core wants it: nodes of a cluster side by side, useless ones left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.core import gtsp as core
from pushplan.world.checks import FloatArray, IntArray


@dataclass(frozen=True)
class Problem:
    """Costs with the nodes ordered by clusters."""

    costs: FloatArray  # (N, N) float64; inf forbids an arc. Arcs inside a cluster mean nothing.
    offsets: IntArray  # (m + 1,) cluster c has the nodes ``offsets[c]`` to ``offsets[c + 1] - 1``
    names: IntArray  # (N,) what the caller calls each node
    forbidden: float | None = None  # `penalty` if it is that of a problem with more nodes

    @staticmethod
    def build(costs: NDArray[np.number], members: Sequence[IntArray]) -> Problem:
        """Gather the members of each cluster; what is in order is not copied."""
        names = np.concatenate(members)
        offsets = np.concatenate(([0], np.cumsum([len(nodes) for nodes in members])))
        if len(names) == len(costs) and (names == np.arange(len(names))).all():
            gathered = np.ascontiguousarray(costs, dtype=np.float64)
        else:
            gathered = costs[np.ix_(names, names)].astype(np.float64)
        return Problem(gathered, offsets.astype(np.int64), names.astype(np.int64))

    def reduced(self) -> Problem:
        """The same without nodes that another one of their cluster can always stand for."""
        needed = np.ones(len(self.costs), np.int64)
        core.mark_needed(self.costs, np.ascontiguousarray(self.costs.T), self.offsets, needed)
        if needed.all():
            return self
        return self.only(np.flatnonzero(needed))

    def only(self, kept: IntArray) -> Problem:
        """The same with some nodes, (k,) ascending, at least one of each cluster."""
        costs = self.costs[np.ix_(kept, kept)]
        return Problem(costs, np.searchsorted(kept, self.offsets), self.names[kept], self.penalty)

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

    @cached_property
    def outer(self) -> FloatArray:
        """(N, N) costs, infinite inside of clusters."""
        result = self.costs.copy()
        for low, high in zip(self.offsets[:-1], self.offsets[1:], strict=True):
            result[low:high, low:high] = np.inf
        return result

    @cached_property
    def penalty(self) -> float:
        """Cost of a forbidden arc, which no tour over finite arcs reaches."""
        if self.forbidden is not None:
            return self.forbidden
        inside = self.outer[np.isfinite(self.outer)]
        low, high = (inside.min(), inside.max()) if inside.size else (0.0, 1.0)
        return float(high + (self.count + 1) * (high - low) + (abs(high) or 1.0))

    @cached_property
    def finite(self) -> FloatArray:
        """(N, N + SPARE) costs; a forbidden arc costs `penalty`."""
        wide = np.full((len(self.costs), len(self.costs) + core.SPARE), self.penalty)
        wide[:, : -core.SPARE] = np.where(np.isfinite(self.costs), self.costs, self.penalty)
        return wide

    @cached_property
    def reverse(self) -> FloatArray:
        """(N, N + SPARE) the same of the transposed costs."""
        if self.symmetric:
            return self.finite
        wide = np.full_like(self.finite, self.finite[0, -1])
        wide[:, : -core.SPARE] = self.finite[:, : -core.SPARE].T
        return wide

    @cached_property
    def into(self) -> FloatArray:
        """(m, N) cheapest arc from each cluster to each node."""
        return _cheapest(self.finite, self.offsets)

    @cached_property
    def onto(self) -> FloatArray:
        """(m, N) cheapest arc from each node to each cluster."""
        if self.symmetric:
            return self.into
        return _cheapest(self.reverse, self.offsets)

    @cached_property
    def symmetric(self) -> bool:
        """True if every arc costs the same in both directions."""
        return bool(np.array_equal(self.costs, self.costs.T))

    @cached_property
    def floor(self) -> float:
        """No tour is cheaper: into every cluster by its cheapest arc, or out of it."""
        starts = self.offsets[:-1]
        into = np.minimum.reduceat(self.outer.min(axis=0), starts)
        out = np.minimum.reduceat(self.outer.min(axis=1), starts)
        return max(math.fsum(into), math.fsum(out))  # rounded once, as the cost of a tour is

    def nearest(self, most: int) -> tuple[IntArray, FloatArray]:
        """(m, k) nearest clusters of each and their distances: reduced costs, the cheaper way.

        The column minima, then the row minima are taken off, as a cost of its own that every arc
        into a node has says nothing about which cluster is near.
        """
        reduced = self.outer - _known(self.outer.min(axis=0))
        reduced -= _known(reduced.min(axis=1))[:, None]
        starts = self.offsets[:-1]
        between = np.minimum.reduceat(np.minimum.reduceat(reduced, starts, 0), starts, 1)
        between = np.minimum(between, between.T)
        np.fill_diagonal(between, np.inf)
        order = np.argsort(between, axis=1, kind="stable")
        order = order[order != np.arange(self.count)[:, None]].reshape(self.count, -1)
        near = np.ascontiguousarray(order[:, :most])
        return near, np.ascontiguousarray(np.take_along_axis(between, near, 1))


def tour_cost(costs: NDArray[np.number], nodes: IntArray) -> float:
    """Cost of a closed tour: the sum of its arcs, rounded once; 0 for a single node."""
    if len(nodes) < 2:
        return 0.0
    arcs = costs[nodes, np.append(nodes[1:], nodes[0])]
    if np.isinf(arcs).any():
        return math.inf
    return math.fsum(arcs.tolist())


def _cheapest(wide: FloatArray, offsets: IntArray) -> FloatArray:
    least: FloatArray = np.minimum.reduceat(wide[:, : -core.SPARE], offsets[:-1], axis=0)
    return np.ascontiguousarray(least)


def _known(values: FloatArray) -> FloatArray:
    return np.where(np.isfinite(values), values, 0.0)


def usable(
    costs: NDArray[np.number],  # (N, N)
    members: Sequence[IntArray],  # nodes of each cluster
) -> list[IntArray]:
    """The members of each cluster without nodes that no tour can enter or leave."""
    if costs.dtype.kind != "f" or not np.isinf(costs.max()):
        return list(members)
    arcs = np.isfinite(costs)
    for nodes in members:
        arcs[np.ix_(nodes, nodes)] = False
    active = np.ones(len(costs), dtype=bool)
    while True:
        gone = active & ~(arcs.any(axis=0) & arcs.any(axis=1))
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
