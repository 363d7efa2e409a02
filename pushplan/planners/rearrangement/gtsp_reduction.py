"""Set covering as a generalised travelling salesman problem.

Each object is a cluster. A push that takes one object along is one node. A push that takes several
becomes one copy for each of them, one in each of their clusters, chained by free arcs: the chain is
entered only at its first copy and left only at its last, so a tour that uses one of the copies
uses them all, one after the other, and every cluster is visited once. As some of what a push takes
along may have gone before, it stands for every part of it too, at the same cost. The robot is a
cluster of one node to which every chain leads back for nothing, so the tour is an open path.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from pushplan.world.checks import FloatArray

PARTS = 3
"""Pushes that take more than so many objects along stand for all of them and for each one alone."""


@dataclass(frozen=True, eq=False)
class GtspReduction:
    """A set-covering problem as a GTSP.

    Args:
        costs: (M, M) arcs between nodes, node 0 is the robot.
        clusters: nodes of each object, in order, and last that of the robot.
        pushes: (M,) index of the push that each node stands for, -1 for the robot.
    """

    costs: FloatArray
    clusters: list[list[int]]
    pushes: list[int]

    def order(self, nodes: list[int]) -> list[int]:
        """The pushes along a closed tour over nodes, from the robot on."""
        at = nodes.index(0)
        found: list[int] = []
        for node in nodes[at + 1 :] + nodes[:at]:
            if not found or found[-1] != self.pushes[node]:
                found.append(self.pushes[node])
        return found


def reduce_to_gtsp(costs: FloatArray, masks: list[int], objects: int) -> GtspReduction:
    """Write a set-covering problem as a GTSP.

    Args:
        costs: (N + 1, N) cost of each push after each other one, the last row after the start.
        masks: what each push delivers, one bit an object.
        objects: how many objects there are.
    """
    firsts, lasts, chains = [], [], []
    clusters: list[list[int]] = [[] for _ in range(objects)]
    owners, count = [-1], 1
    for n, mask in enumerate(masks):
        if not np.isfinite(costs[:, n]).any():
            continue
        for part in parts_of(mask):
            nodes = list(range(count, count + len(part)))
            for node, b in zip(nodes, part, strict=True):
                clusters[b].append(node)
            owners += [n] * len(part)
            firsts.append(nodes[0])
            lasts.append(nodes[-1])
            chains += list(pairwise(nodes))
            count += len(part)
    out = np.full((count, count), np.inf)
    which = np.array([owners[node] for node in firsts], dtype=np.int64)
    if len(which):
        out[np.ix_(lasts, firsts)] = costs[np.ix_(which, which)]
        out[0, firsts] = costs[-1, which]
        out[lasts, 0] = 0.0
    for a, b in chains:
        out[a, b] = 0.0
    return GtspReduction(out, [*clusters, [0]], owners)


def parts_of(mask: int) -> list[tuple[int, ...]]:
    """The sets of objects that a push stands for."""
    whole = tuple(b for b in range(mask.bit_length()) if mask >> b & 1)
    if len(whole) > PARTS:
        return [whole, *((b,) for b in whole)]
    return [part for size in range(1, len(whole) + 1) for part in combinations(whole, size)]
