"""`PushChoice`: what to do next, chosen in one planning call, perhaps for a later scene."""

from __future__ import annotations

import copy
import math
import numbers
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.errors import InvalidInputError, short
from pushplan.motion.room_ahead import recovery_path
from pushplan.planners.rearrangement.approach import (
    ApproachTree,
    Route,
    approach_tree,
    find_route,
    simulate_route,
)
from pushplan.planners.rearrangement.push import Push, PushCost, PushHistory
from pushplan.planners.rearrangement.push_graph import PushGraph, build_push_graph
from pushplan.planners.rearrangement.push_order import sequence_pushes
from pushplan.planners.rearrangement.push_scene import MARGIN, PushScene, pose_distance
from pushplan.planners.rearrangement.push_simulator import resimulate
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.world import PendingResult, PlanningExecutor, Stop, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length, path_lengths
from pushplan.world.stop import wants_own_budget

_ROBOT_OFF = 0.5
_OBJECT_OFF = 0.2
"""Greatest distances from the predicted poses in a scene that a choice is still good for
[circumscribed radii]."""
_RECOVERY_S = 0.05
"""Time that a path out of a tight place takes, roughly [s]."""
_FORGETTING = 0.9
"""Factor on the longest time of a first push with its approach, at each further one."""
_NEAREST = 2
"""For so many objects, the nearest ones, relocations are looked for at first."""


@dataclass(frozen=True, eq=False)
class SimulatedPush:
    """A push with the route to it.

    Args:
        cost: of both [m]; inf where the push would not do what it is for.
        route: to its start.
        push: what it is predicted to do after that route.
    """

    cost: float
    route: Route
    push: Push


@dataclass(frozen=True, eq=False)
class PushChoice:
    """Result of choosing a push.

    Args:
        graph: the candidate pushes.
        plan: the pushes to be made, in order.
        first: the first of them with the route to it; None if there is none.
        recovery: (N, 3) path out of a tight place, where there is no push; None if there are none.
        interrupted: a stop rule left something out of the search.
        searches: objects for which relocations were searched.
    """

    graph: PushGraph
    plan: tuple[Push, ...]
    first: SimulatedPush | None
    recovery: FloatArray | None = None
    interrupted: bool = False
    searches: int = 0


@dataclass(frozen=True, eq=False)
class PendingChoice:
    """A choice that may not have been made yet.

    Args:
        scene: for which it is made.
        call: its planning call.
        ahead: the scene is one that is still to come.
    """

    scene: PushScene
    call: PendingResult[PushChoice]
    ahead: bool = False

    def fits(self, scene: PushScene) -> bool:
        """Return True if the choice is good for the scene that has come."""
        if not self.ahead:
            return True
        then = self.scene
        now = scene
        size = scene.size
        ids = now.movables.ids[~now.done]
        if not np.array_equal(ids, then.movables.ids[~then.done]):
            return False
        if pose_distance(then.world.robot_pose, now.world.robot_pose, size) > _ROBOT_OFF:
            return False
        pairs = zip(then.poses[~then.done], now.poses[~now.done], strict=True)
        return all(pose_distance(a, b, size) <= _OBJECT_OFF for a, b in pairs)


def choose_push(
    scene: PushScene,
    history: PushHistory,
    executor: PlanningExecutor,
    stop: Stop | None,
    costs: Sequence[PushCost] = (),
    ahead: bool = False,
    last: Sequence[Push] = (),
    now: float | None = None,
    collect: bool = False,
) -> PendingChoice:
    """Ask for the best push, or else a recovery path.

    Args:
        scene: now, or where everything is expected to be.
        history: what has been tried; it is copied.
        executor: runs the search.
        stop: its stop rule; without one no more pushes than the config allows are simulated.
        costs: terms of a user, which are added to the cost of a push.
        ahead: the scene is still to come.
        last: the pushes of the last plan, in order.
        now: time of the world [s]; that of the scene by default.
        collect: where a choice is known for the scene, only simulate further pushes.
    """
    history = copy.deepcopy(history)
    config = scene.config
    size = scene.size
    terms = [partial(_checked, cost, scene.world) for cost in costs]

    def penalty(push: Push) -> float:
        return history.penalty(push, config) * size + sum(term(push) for term in terms)

    def find_recovery() -> FloatArray | None:
        return recovery_path(scene.world, 0.5 * MARGIN * size)

    def choose(rule: Stop | None) -> PushChoice:
        assert scene.cache is not None
        scene.cache.age()
        most = math.inf
        if wants_own_budget(rule):
            most = config.max_rollouts
        known: PushChoice | None = scene.progress.get("choice")
        collects = collect and known is not None
        scene.budget.start(rule, most, found=known is not None, collects=collects)
        if known is not None and collects:
            scene.progress["delivering"].fill(scene.budget)
            if scene.budget.out_of_time:
                return replace(known, interrupted=True)
        if "no push" in scene.progress:
            scene.known("recovery", find_recovery)
        choice = select_push(scene, penalty, last)
        if choice.first is not None:
            scene.progress["choice"] = choice
        recovery = None
        if choice.first is None and not scene.budget.stopped:
            if "recovery" in scene.progress or scene.budget.has_room(_RECOVERY_S):
                recovery = scene.known("recovery", find_recovery)
            else:
                scene.progress["no push"] = True
        return replace(
            choice,
            recovery=recovery,
            interrupted=scene.budget.interrupted,
            searches=scene.cache.searches,
        )

    began = scene.world.time if now is None else now
    return PendingChoice(scene, executor.submit(choose, began, stop), ahead)


def _checked(cost: PushCost, world: World, push: Push) -> float:
    """Return what a term of a user says."""
    found = cost(world, push)
    if not isinstance(found, numbers.Real) or math.isnan(found) or found == -math.inf:
        raise InvalidInputError(
            f"the cost {short(cost)} must give a number above -inf for a push, got {short(found)}"
        )
    return float(found)


def scene_after(scene: PushScene, push: Push) -> PushScene:
    """The scene that is expected at the end of a push."""
    world = scene.world
    after = push.object_poses
    there = np.flatnonzero(after[:, 0] < 0.5 * core.REMOVED)
    movables = world.movables.select(there).moved_to(after[there])
    moved = replace(world, robot_pose=push.end, robot_twist=np.zeros(3), movables=movables)
    return PushScene(moved, scene.config, scene.cache, delivered=scene.delivered)


def select_push(
    scene: PushScene,
    penalty: Callable[[Push], float] = lambda _: 0.0,
    last: Sequence[Push] = (),
) -> PushChoice:
    """Sequence anew: the pushes to make, and the first of them with the route to it.

    Where no push home can be carried out, those that end on the way count as well, and where none
    of these can, drives that free an object: first for the nearest objects, then for all, with
    approaches on a finer lattice.

    Args:
        scene: the scene.
        penalty: what to add to the cost of a push [m].
        last: the pushes of the last plan, in order.
    """
    choice = _select(scene, build_push_graph(scene, penalty), penalty, last)
    while scene.budget.next_round():
        better = _select(scene, build_push_graph(scene, penalty), penalty, choice.plan or last)
        if better.first is not None or choice.first is None:
            choice = better
    left = len(scene.left)
    for relocations, thorough in ((0, False), (min(_NEAREST, left), False), (left, True)):
        if choice.first is None and not scene.budget.is_used_up:
            if thorough:
                if not scene.budget.has_room(scene.finer_lattice_s):
                    break
                scene = scene.known("finer", scene.on_finer_lattice)
            graph = build_push_graph(
                scene, penalty, onward=True, relocations=relocations, thorough=thorough
            )
            choice = _select(scene, graph, penalty, last)
    return choice


def _select(
    scene: PushScene,
    graph: PushGraph,
    penalty: Callable[[Push], float],
    last: Sequence[Push],
) -> PushChoice:
    """The cheapest order, with its first push simulated.

    It is simulated on the cheapest path, and if that spoils the push around its object.
    """
    known: dict[int, SimulatedPush] = {}
    budget = scene.budget
    simulated: dict[int, tuple[Push, SimulatedPush | None]] = scene.known("simulated", dict)
    cache = RolloutCache() if scene.cache is None else scene.cache

    def simulated_cost(n: int) -> tuple[float, tuple[int, ...]] | None:
        push = graph.pushes[n]
        if id(push) not in simulated:
            if budget.is_used_up:
                if budget.stopped or any(math.isfinite(one.cost) for one in known.values()):
                    return None
            if budget.seconds < math.inf and not budget.has_room(cache.push_s):
                return None
            began = time.perf_counter()
            simulated[id(push)] = push, _first_push(scene, graph.approach, push)
            took = time.perf_counter() - began
            cache.push_s = max(took, _FORGETTING * cache.push_s)
        found = simulated[id(push)][1]
        if found is None:
            return math.inf, ()
        known[n] = found
        budget.cost = min(budget.cost, found.cost)
        return found.cost + penalty(push), found.push.delivers

    done = [n for n, push in enumerate(graph.pushes) if id(push) in simulated]
    order = sequence_pushes(
        graph, simulated_cost, scene.config.max_simulations, budget.time_limit, last, done
    )
    plan = tuple(graph.pushes[n] for n in order)
    return PushChoice(graph, plan, known[order[0]] if order else None)


def _first_push(scene: PushScene, approach: ApproachTree, push: Push) -> SimulatedPush | None:
    """A push with the route to it, which leads around its object where the cheapest one fails.

    A push that is begun is finished: the next decision would begin with the same one.
    """
    if scene.is_jammed:
        return None
    target = int(np.flatnonzero(scene.movables.ids == push.target)[0])
    found = _simulated(scene, approach, push, target)
    if found is None or not math.isfinite(found.cost):
        around = scene.known(("around", target), lambda: approach_tree(scene, target))
        found = _simulated(scene, around, push, target) or found
    return found


def _simulated(
    scene: PushScene, approach: ApproachTree, push: Push, target: int
) -> SimulatedPush | None:
    """A push as the route to it leaves robot and objects; None if there is no route."""
    route = find_route(scene, approach, push.start, target)
    if route is None:
        return None
    driven = simulate_route(scene, route)
    if driven is not None:
        path, objects = driven
        spent = path_lengths(objects)
        ends = resimulate(scene, push, path[-1], objects[-1].copy(), spent)
        for end in ends:
            if push.relocates or set(push.delivers) <= set(end.delivers):
                return SimulatedPush(path_length(path[:, :2]) + end.cost, route, end)
    return SimulatedPush(math.inf, route, push)
