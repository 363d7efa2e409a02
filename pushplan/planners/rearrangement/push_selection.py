"""Which push comes first: the order of the cheapest tour, with its first pushes simulated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pushplan.planners.rearrangement.approach import ApproachTree, approach_tree
from pushplan.planners.rearrangement.forward_simulation import SimulatedPush, simulate_push
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_graph import PushGraph, build_push_graph
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.route import RoutePlanner
from pushplan.planners.rearrangement.sequencing import sequence_pushes


@dataclass(frozen=True, eq=False)
class Selection:
    """What is planned.

    Args:
        graph: the candidate pushes.
        order: indices of those to be made, in order.
        first: the first of them with the route to it; None if there is none.
    """

    graph: PushGraph
    order: tuple[int, ...]
    first: SimulatedPush | None

    @property
    def plan(self) -> tuple[Push, ...]:
        """The pushes to be made, in order."""
        return tuple(self.graph.pushes[n] for n in self.order)


def select_push(scene: PushScene, penalty: Callable[[Push], float]) -> Selection:
    """Sequence anew: the pushes to make, and the first of them with the route to it.

    Where no push home can be carried out, those that end on the way count as well, and where none
    of these can, drives that free an object: first for the nearest objects, then for all, with
    approaches on a finer lattice.

    Args:
        scene: the scene.
        penalty: what to add to the cost of a push [m].
    """
    selection = _select(scene, build_push_graph(scene, penalty), penalty)
    left = int((~scene.done).sum())
    few = min(scene.config.relocation.objects, left)
    for relocations, thorough in ((0, False), (few, False), (left, True)):
        if selection.first is None and not scene.budget.is_used_up:
            if thorough:
                scene = scene.on_finer_lattice()
            graph = build_push_graph(
                scene, penalty, onward=True, relocations=relocations, thorough=thorough
            )
            selection = _select(scene, graph, penalty)
    return selection


def _select(scene: PushScene, graph: PushGraph, penalty: Callable[[Push], float]) -> Selection:
    known: dict[int, SimulatedPush] = {}
    forward = _ForwardSimulator(scene, graph.approach)

    def simulated_cost(n: int) -> tuple[float, tuple[int, ...]] | None:
        if scene.budget.is_used_up and any(math.isfinite(one.cost) for one in known.values()):
            return None
        push = graph.pushes[n]
        found = forward.of(push)
        if found is None:
            return math.inf, ()
        known[n] = found
        scene.budget.cost = min(scene.budget.cost, found.cost)
        return found.cost + penalty(push), found.push.delivers

    order = sequence_pushes(graph, simulated_cost, scene.config.max_simulations)
    return Selection(graph, tuple(order), known[order[0]] if order else None)


class _ForwardSimulator:
    """Simulates pushes: on the cheapest path, and if that spoils the push around its object."""

    def __init__(self, scene: PushScene, approach: ApproachTree) -> None:
        self._scene, self._approach = scene, approach
        self._planner, self._simulator = RoutePlanner(scene), PushSimulator(scene)
        self._around: dict[int, ApproachTree] = {}

    def of(self, push: Push) -> SimulatedPush | None:
        """The push with the cheapest route to it that was found; None if there is none."""
        target = int(np.flatnonzero(self._scene.world.movables.ids == push.target)[0])
        found = self._along(self._approach, push, target)
        if found is None or not math.isfinite(found.cost):
            if target not in self._around:
                self._around[target] = approach_tree(self._scene, target)
            found = self._along(self._around[target], push, target) or found
        return found

    def _along(self, approach: ApproachTree, push: Push, target: int) -> SimulatedPush | None:
        route = self._planner.route(approach, push.start, target)
        return None if route is None else simulate_push(self._planner, self._simulator, route, push)
