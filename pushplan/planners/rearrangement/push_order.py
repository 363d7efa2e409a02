"""The cheapest order of the pushes of a graph, as the graph has their costs, or once simulated."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.gtsp import solve_gtsp
from pushplan.planners.rearrangement.push import Push, signature
from pushplan.planners.rearrangement.push_graph import PushGraph
from pushplan.world import MaxIterations, Stop
from pushplan.world.checks import FloatArray, IntArray


def _order_after(
    following: IntArray, masks: IntArray, mask: int, last: int, order: list[int]
) -> list[int]:
    """An order, gone on with the cheapest pushes after what is delivered and the last push."""
    while following[mask, last] >= 0:
        last = int(following[mask, last])
        mask |= int(masks[last])
        order.append(last)
    return order


def push_order(
    graph: PushGraph,
    iterations: int = 300,
    *,
    stop: Stop | None = None,
    initial: Sequence[int] = (),
) -> tuple[list[int], float]:
    """The cheapest order of pushes that is found: their indices, and its cost [m].

    Objects without a push are left out. Up to `core.MAX_EXACT` objects the order is the
    cheapest there is; beyond, `solve_gtsp` searches for one on the reduced problem.

    Args:
        graph: the pushes and their costs.
        iterations: rounds of that search.
        stop: ends it, too.
        initial: an order that it begins with, if that is one.
    """
    count = len(graph.objects)
    if not count:
        return [], 0.0
    if count <= core.MAX_EXACT:
        best, following = core.cost_to_go(graph.costs, graph.masks, count)
        start = len(graph.pushes)
        return _order_after(following, graph.masks, 0, start, []), float(best[0, start])
    reduced = graph.to_gtsp()
    rule: Stop = MaxIterations(iterations)
    tour = solve_gtsp(
        reduced.costs,
        reduced.clusters,
        stop=rule if stop is None else rule | stop,
        initial=reduced.tour(initial),
    )
    if not tour.status.has_tour:
        return [], math.inf
    return reduced.order([int(node) for node in tour.nodes]), float(tour.cost)


SimulatedCost = Callable[[int], tuple[float, tuple[int, ...]] | None]
"""From the index of a push to its cost from where the robot is now [m], and what it then delivers;
None where the search has to return with what is simulated by now."""


def sequence_pushes(
    graph: PushGraph,
    simulated_cost: SimulatedCost,
    most: int,
    stop: Stop | None = None,
    last: Sequence[Push] = (),
    done: Sequence[int] = (),
) -> list[int]:
    """The order of pushes, with the first one simulated.

    The graph knows approaches roughly. The push that the cheapest order begins with is
    simulated, until no other order could be cheaper.

    Args:
        graph: the pushes and their costs.
        simulated_cost: simulates a push.
        most: how many pushes are simulated at most.
        stop: a time limit; None for none.
        last: the pushes of the last plan, in order, from which a search with a time limit begins.
        done: pushes that have been simulated before, which such a search knows.
    """
    count = len(graph.objects)
    if not count:
        return []
    if count > core.MAX_EXACT:
        return _by_tours(graph, simulated_cost, most, stop, last, done)
    best, following = core.cost_to_go(graph.costs, graph.masks, count)
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
    if chosen < 0:
        return []
    return _order_after(following, graph.masks, mask, chosen, [chosen])


def _by_tours(
    graph: PushGraph,
    simulated_cost: SimulatedCost,
    most: int,
    stop: Stop | None,
    last: Sequence[Push],
    done: Sequence[int],
) -> list[int]:
    """As `sequence_pushes`, with a tour anew for every push that is simulated."""
    initial: list[int] = []
    costs: FloatArray = graph.costs.copy()
    known: dict[int, float] = {}
    if stop is not None:
        for n in done:
            found = simulated_cost(n)
            if found is not None:
                known[n] = costs[-1, n] = found[0]
        places = {signature(push): n for n, push in enumerate(graph.pushes)}
        initial = [places[key] for key in map(signature, last) if key in places]
        initial += np.argsort(graph.costs[-1], kind="stable").tolist()
    for _ in range(most):
        order, total = push_order(replace(graph, costs=costs), stop=stop, initial=initial)
        if not order or not math.isfinite(total):
            break
        if order[0] in known:
            return order
        found = simulated_cost(order[0])
        if found is None:
            costs[-1, [n for n in range(costs.shape[1]) if n not in known]] = np.inf
        else:
            known[order[0]] = costs[-1, order[0]] = found[0]
        if stop is not None:
            initial = order
            if found is None or math.isinf(found[0]):
                initial = [*order[1:], order[0]]
    rest = [n for n in known if math.isfinite(known[n])]
    rest.sort(key=lambda n: (known[n] / len(graph.pushes[n].serves), n))
    return rest[:1]
