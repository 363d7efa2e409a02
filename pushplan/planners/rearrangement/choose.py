"""Which push comes first: the order of the cheapest tour, with its first pushes rehearsed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.planners.rearrangement.approach import Approach, approach_from
from pushplan.planners.rearrangement.forward_simulation import Rehearsal, rehearse
from pushplan.planners.rearrangement.graph import FREED, SubTaskGraph, build_graph
from pushplan.planners.rearrangement.push import Push, signature
from pushplan.planners.rearrangement.route import Router
from pushplan.planners.rearrangement.runner import Runner
from pushplan.planners.rearrangement.scene import Scene
from pushplan.planners.rearrangement.tours import sequence


@dataclass(frozen=True, eq=False)
class Choice:
    """What is planned.

    Args:
        graph: the candidate pushes.
        order: indices of those to be made, in order.
        first: the first of them with the way to it; None if there is none.
    """

    graph: SubTaskGraph
    order: tuple[int, ...]
    first: Rehearsal | None

    @property
    def plan(self) -> tuple[Push, ...]:
        """The pushes to be made, in order."""
        return tuple(self.graph.pushes[n] for n in self.order)


def choose(scene: Scene, penalties: dict[tuple[object, ...], float]) -> Choice:
    """Sequence anew: the pushes to make, and the first of them with the way to it.

    Where no push can be carried out, those that only free an object are looked at too: first those
    for the nearest objects, then for all.

    Args:
        scene: the scene.
        penalties: what to add to the price of a push, by `signature` [m].
    """
    choice = _chosen(scene, build_graph(scene, penalties), penalties)
    frees = any(push.frees for push in choice.graph.pushes)
    for freeing in (FREED, int((~scene.done).sum())):
        if choice.first is None and not (frees and freeing <= FREED):
            choice = _chosen(scene, build_graph(scene, penalties, freeing=freeing), penalties)
    return choice


def _chosen(
    scene: Scene, graph: SubTaskGraph, penalties: dict[tuple[object, ...], float]
) -> Choice:
    known: dict[int, Rehearsal] = {}
    rehearsing = _Rehearsing(scene, graph.approach)

    def honest(n: int) -> tuple[float, tuple[int, ...]]:
        push = graph.pushes[n]
        found = rehearsing.of(push)
        if found is None:
            return math.inf, ()
        known[n] = found
        return found.price + penalties.get(signature(push), 0.0), found.push.covers

    order = sequence(graph, honest, scene.config.rehearsals)
    return Choice(graph, tuple(order), known[order[0]] if order else None)


class _Rehearsing:
    """Rehearses pushes: on the cheapest way, and if that spoils the push around its object."""

    def __init__(self, scene: Scene, approach: Approach) -> None:
        self._scene, self._approach = scene, approach
        self._router, self._runner = Router(scene), Runner(scene)
        self._around: dict[int, Approach] = {}

    def of(self, push: Push) -> Rehearsal | None:
        """The push with the cheapest way to it that was found; None if there is none."""
        led = int(np.flatnonzero(self._scene.world.movables.ids == push.led)[0])
        found = self._along(self._approach, push, led)
        if found is None or not math.isfinite(found.price):
            if led not in self._around:
                self._around[led] = approach_from(self._scene, led)
            found = self._along(self._around[led], push, led) or found
        return found

    def _along(self, approach: Approach, push: Push, led: int) -> Rehearsal | None:
        route = self._router.route(approach, push.start, led)
        return None if route is None else rehearse(self._router, self._runner, route, push)
