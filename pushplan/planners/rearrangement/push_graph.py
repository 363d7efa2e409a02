"""`PushGraph`: candidate pushes, what they deliver, what lies between them, and their best order.

**Reduction.** To deliver all objects is a problem of set covering. As a generalised travelling
salesman problem, each object is a cluster. A push that takes one object along is one node. A push
that takes several becomes one copy for each of them, one in each of their clusters, chained by free
arcs: the chain is entered only at its first copy and left only at its last, so a tour that uses one
of the copies uses them all, one after the other, and every cluster is visited once. As some of what
a push takes along may have gone before, it stands for every part of it too, at the same cost. The
robot is a cluster of one node to which every chain leads back for nothing, so the tour is an open
path.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np

from pushplan.gtsp import solve_gtsp
from pushplan.planners.rearrangement.approach import ApproachTree
from pushplan.planners.rearrangement.cost_to_go_kernels import MAX_EXACT, MAX_OBJECTS, cost_to_go
from pushplan.planners.rearrangement.push import Push
from pushplan.world import MaxIterations
from pushplan.world.checks import FloatArray, IntArray

if TYPE_CHECKING:
    import networkx as nx

_PARTS = 3
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
    firsts = []
    lasts = []
    chains = []
    clusters: list[list[int]] = [[] for _ in range(objects)]
    owners = [-1]
    count = 1
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
    if len(whole) > _PARTS:
        return [whole, *((b,) for b in whole)]
    return [part for size in range(1, len(whole) + 1) for part in combinations(whole, size)]


@dataclass(frozen=True, eq=False)
class PushGraph:
    """The pushes of one scene with their costs.

    Args:
        pushes: N candidates.
        costs: (N + 1, N) cost [m] of each push after each other, approach included; the last row
            from where the robot is. inf where there is no path.
        approach: from where the robot is.
        infeasible: why there is no push for an object, by id.
    """

    pushes: tuple[Push, ...]
    costs: FloatArray
    approach: ApproachTree
    infeasible: dict[int, str]

    @cached_property
    def objects(self) -> tuple[int, ...]:
        """Ids of the objects that it has a push for, in the order of the bits of `masks`."""
        reachable = [n for n in range(len(self.pushes)) if np.isfinite(self.costs[-1, n])]
        return tuple(sorted({i for n in reachable for i in self.pushes[n].serves})[:MAX_OBJECTS])

    @cached_property
    def masks(self) -> IntArray:
        """(N,) what each push delivers; an object that can only be relocated counts as well."""
        return np.array([self.mask(push.serves) for push in self.pushes], dtype=np.int64)

    def mask(self, ids: tuple[int, ...]) -> int:
        """A set of objects in a machine word; those that nothing delivers are left out."""
        return sum(1 << b for b, i in enumerate(self.objects) if i in ids)

    def to_gtsp(self) -> GtspReduction:
        """The choice and the order of its pushes as a generalised travelling salesman problem."""
        return reduce_to_gtsp(self.costs, self.masks.tolist(), len(self.objects))

    def to_networkx(self) -> nx.DiGraph[int]:
        """The same problem as a graph that `solve_gtsp` takes.

        Node 0 is where the robot is. Each other node is a push, for one of the objects that it
        takes along.

        Returns:
            A graph whose nodes have the attributes ``cluster``, an object's id or ``"robot"``, and
            ``push``, a place in `pushes` or -1; the ``weight`` of an edge is its cost [m].
        """
        import networkx as nx

        problem = self.to_gtsp()
        graph: nx.DiGraph[int] = nx.DiGraph()
        for cluster, nodes in zip((*self.objects, "robot"), problem.clusters, strict=True):
            for node in nodes:
                graph.add_node(node, cluster=cluster, push=problem.pushes[node])
        for a, b in np.argwhere(np.isfinite(problem.costs)).tolist():
            graph.add_edge(a, b, weight=float(problem.costs[a, b]))
        return graph


def _order_after(
    following: IntArray, masks: IntArray, mask: int, last: int, order: list[int]
) -> list[int]:
    """An order, gone on with the cheapest pushes after what is delivered and the last push."""
    while following[mask, last] >= 0:
        last = int(following[mask, last])
        mask |= int(masks[last])
        order.append(last)
    return order


def push_order(graph: PushGraph, iterations: int = 300) -> tuple[list[int], float]:
    """The cheapest order of pushes that is found: their indices, and its cost [m].

    Objects without a push are left out. Up to `MAX_EXACT` objects the order is the cheapest there
    is; beyond, `solve_gtsp` searches for one on the reduced problem.
    """
    count = len(graph.objects)
    if not count:
        return [], 0.0
    if count <= MAX_EXACT:
        best, following = cost_to_go(graph.costs, graph.masks, count)
        start = len(graph.pushes)
        return _order_after(following, graph.masks, 0, start, []), float(best[0, start])
    reduced = graph.to_gtsp()
    tour = solve_gtsp(reduced.costs, reduced.clusters, stop=MaxIterations(iterations))
    if not tour.status.has_tour:
        return [], math.inf
    return reduced.order([int(node) for node in tour.nodes]), float(tour.cost)


SimulatedCost = Callable[[int], tuple[float, tuple[int, ...]] | None]
"""From the index of a push to its cost from where the robot is now [m], and what it then delivers;
None where the search has to return with what is simulated by now."""


def sequence_pushes(graph: PushGraph, simulated_cost: SimulatedCost, most: int) -> list[int]:
    """The order of pushes, with the first one simulated.

    The graph knows approaches roughly. The push that the cheapest order begins with is
    simulated, until no other order could be cheaper.

    Args:
        graph: the pushes and their costs.
        simulated_cost: simulates a push.
        most: how many pushes are simulated at most.
    """
    count = len(graph.objects)
    if not count:
        return []
    if count > MAX_EXACT:
        return _by_tours(graph, simulated_cost, most)
    best, following = cost_to_go(graph.costs, graph.masks, count)
    rest = np.array([best[graph.masks[n], n] for n in range(len(graph.masks))])
    guess = graph.costs[-1] + rest
    chosen = -1
    value = math.inf
    mask = 0
    for n in np.argsort(guess, kind="stable").tolist()[:most]:
        if guess[n] >= value:
            break
        found = simulated_cost(n)
        if found is None:
            break
        cost, delivers = found
        after = graph.mask(delivers) | int(graph.masks[n])
        total = cost + float(best[after, n])
        if total < value:
            chosen = n
            value = total
            mask = after
    return _order_after(following, graph.masks, mask, chosen, [chosen]) if chosen >= 0 else []


def _by_tours(graph: PushGraph, simulated_cost: SimulatedCost, most: int) -> list[int]:
    """As `sequence_pushes`, with a tour anew for every push that is simulated."""
    costs: FloatArray = graph.costs.copy()
    known: dict[int, float] = {}
    for _ in range(most):
        order, total = push_order(replace(graph, costs=costs))
        if not order or not math.isfinite(total):
            break
        if order[0] in known:
            return order
        found = simulated_cost(order[0])
        if found is None:
            costs[-1, [n for n in range(costs.shape[1]) if n not in known]] = np.inf
        else:
            known[order[0]] = costs[-1, order[0]] = found[0]
    rest = [n for n in known if math.isfinite(known[n])]
    return [min(rest, key=lambda n: (known[n] / len(graph.pushes[n].serves), n))] if rest else []
