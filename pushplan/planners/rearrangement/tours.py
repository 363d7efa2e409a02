"""From a sub-task graph to an order of pushes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pushplan.gtsp import solve_gtsp
from pushplan.planners.rearrangement.completions import EXACT, MOST, completions
from pushplan.planners.rearrangement.graph import SubTaskGraph
from pushplan.planners.rearrangement.reduction import reduce
from pushplan.world import MaxIterations
from pushplan.world.checks import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Cover:
    """What the pushes of a graph cover, as sets in machine words.

    Args:
        boxes: ids of the objects, in the order of the bits.
        masks: (N,) sets.
    """

    boxes: tuple[int, ...]
    masks: IntArray

    def mask(self, ids: tuple[int, ...]) -> int:
        """The set of some objects; those that nothing covers are left out."""
        return sum(1 << b for b, i in enumerate(self.boxes) if i in ids)


def cover_of(graph: SubTaskGraph) -> Cover:
    """The sets of a graph; an object that can only be freed counts as covered by that."""
    reachable = [n for n in range(len(graph.pushes)) if np.isfinite(graph.costs[-1, n])]
    boxes = tuple(sorted({i for n in reachable for i in graph.pushes[n].serves})[:MOST])
    cover = Cover(boxes, np.zeros(0, dtype=np.int64))
    masks = np.array([cover.mask(push.serves) for push in graph.pushes], dtype=np.int64)
    return Cover(boxes, masks)


def tour_of(graph: SubTaskGraph, iterations: int = 300) -> tuple[list[int], float]:
    """The cheapest order of pushes that is found: their indices, and its cost [m].

    Objects without a push are left out. Up to `EXACT` objects the order is the cheapest there is;
    beyond, `solve_gtsp` searches for one on the reduced problem.
    """
    cover = cover_of(graph)
    count = len(cover.boxes)
    if not count:
        return [], 0.0
    if count <= EXACT:
        best, following = completions(graph.costs, cover.masks, count)
        order, mask, last = [], 0, len(graph.pushes)
        while following[mask, last] >= 0:
            last = int(following[mask, last])
            mask |= int(cover.masks[last])
            order.append(last)
        return order, float(best[0, len(graph.pushes)])
    reduced = reduce(graph.costs, cover.masks.tolist(), count)
    tour = solve_gtsp(reduced.costs, reduced.clusters, stop=MaxIterations(iterations))
    if not tour.status.has_tour:
        return [], math.inf
    return reduced.order([int(node) for node in tour.nodes]), float(tour.cost)


def sequence(
    graph: SubTaskGraph, honest: Callable[[int], tuple[float, tuple[int, ...]]], most: int
) -> list[int]:
    """The order of pushes, with the first one priced honestly.

    The graph knows approaches roughly. The push that the cheapest order begins with is priced
    anew, until no other order could be cheaper.

    Args:
        graph: the pushes and their costs.
        honest: from the index of a push to its true price from where the robot is now [m], and
            what it then covers.
        most: how many pushes are priced anew at most.
    """
    cover = cover_of(graph)
    count = len(cover.boxes)
    if not count:
        return []
    if count > EXACT:
        return _by_tours(graph, honest, most)
    best, following = completions(graph.costs, cover.masks, count)
    rest = np.array([best[cover.masks[n], n] for n in range(len(cover.masks))])
    guess = graph.costs[-1] + rest
    chosen, value, mask = -1, math.inf, 0
    for n in np.argsort(guess, kind="stable").tolist()[:most]:
        if guess[n] >= value:
            break
        price, covers = honest(n)
        after = cover.mask(covers) | int(cover.masks[n])
        total = price + float(best[after, n])
        if total < value:
            chosen, value, mask = n, total, after
    order: list[int] = []
    while chosen >= 0:
        order.append(chosen)
        follow = int(following[mask, chosen])
        if follow >= 0:
            mask |= int(cover.masks[follow])
        chosen = follow
    return order


def _by_tours(
    graph: SubTaskGraph, honest: Callable[[int], tuple[float, tuple[int, ...]]], most: int
) -> list[int]:
    """As `sequence`, with a tour anew for every push that is priced."""
    costs: FloatArray = graph.costs.copy()
    known: dict[int, float] = {}
    for _ in range(most):
        order, total = tour_of(SubTaskGraph(graph.pushes, costs, graph.approach, {}))
        if not order or not math.isfinite(total):
            break
        if order[0] in known:
            return order
        known[order[0]] = costs[-1, order[0]] = honest(order[0])[0]
    rest = [n for n in known if math.isfinite(known[n])]
    return [min(rest, key=lambda n: (known[n] / len(graph.pushes[n].serves), n))] if rest else []
