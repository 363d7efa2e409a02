"""`PushChoice`: what to do next, chosen in one planning call, perhaps for a later scene."""

from __future__ import annotations

import copy
import math
import numbers
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pushplan.errors import InvalidInputError, short
from pushplan.motion.recovery_path import recovery_path
from pushplan.planners.rearrangement.approach import (
    ApproachTree,
    Route,
    approach_tree,
    arrivals_at,
    find_route,
    search_approaches,
    simulate_route,
)
from pushplan.planners.rearrangement.candidates import delivering_pushes, partial_pushes
from pushplan.planners.rearrangement.goal_kernels import REMOVED
from pushplan.planners.rearrangement.pose_search_kernels import least_costs
from pushplan.planners.rearrangement.push import Push, PushCost, PushHistory
from pushplan.planners.rearrangement.push_graph import PushGraph, sequence_pushes
from pushplan.planners.rearrangement.push_scene import (
    MARGIN,
    PushScene,
    SearchBudget,
    pose_distance,
)
from pushplan.planners.rearrangement.push_simulator import resimulate
from pushplan.planners.rearrangement.relocation import relocating_pushes
from pushplan.world import PendingResult, PlanningExecutor, Stop, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length, path_lengths
from pushplan.world.stop import wants_own_budget

# greatest distance of a scene from the predicted one [circumscribed radii]
_ROBOT = 0.5
_OBJECT = 0.2
_MOST_APPROACHES = 150
"""Ends of pushes from which approaches are searched for; up to 50 objects have no more."""
_FAR = 5.0  # cost of getting to what cannot be got to later [diagonals of the map]
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
        way_out: (N, 3) poses out of a tight place, where there is no push; None if there are none.
        interrupted: whether a stop rule left something out of the search.
        searches: objects for which relocations were searched.
    """

    graph: PushGraph
    plan: tuple[Push, ...]
    first: SimulatedPush | None
    way_out: FloatArray | None = None
    interrupted: bool = False
    searches: int = 0


@dataclass(frozen=True, eq=False)
class PendingChoice:
    """A choice that may not have been made yet.

    Args:
        scene: for which it is made.
        call: its planning call.
        ahead: whether the scene is one that is still to come.
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
        if pose_distance(then.world.robot_pose, now.world.robot_pose, size) > _ROBOT:
            return False
        pairs = zip(then.poses[~then.done], now.poses[~now.done], strict=True)
        return all(pose_distance(a, b, size) <= _OBJECT for a, b in pairs)


def choose_push(
    scene: PushScene,
    history: PushHistory,
    executor: PlanningExecutor,
    stop: Stop | None,
    costs: Sequence[PushCost] = (),
    ahead: bool = False,
) -> PendingChoice:
    """Ask for the best push, or else a way out of a tight place.

    Args:
        scene: now, or where everything is expected to be.
        history: what has been tried; it is copied.
        executor: runs the search.
        stop: its stop rule; without one no more pushes than the config allows are simulated.
        costs: terms of a user, which are added to the cost of a push.
        ahead: whether the scene is still to come.
    """
    history = copy.deepcopy(history)

    def penalty(push: Push) -> float:
        tried = history.penalty(push, scene.config) * scene.size
        return tried + sum(_checked(cost, scene.world, push) for cost in costs)

    def choose(rule: Stop | None) -> PushChoice:
        assert scene.cache is not None
        scene.cache.age()
        most = scene.config.max_rollouts if wants_own_budget(rule) else math.inf
        budget = SearchBudget(rule, most)
        choice = select_push(scene.changed(budget=budget), penalty)
        margin = 0.5 * MARGIN * scene.size
        return replace(
            choice,
            way_out=recovery_path(scene.world, margin) if choice.first is None else None,
            interrupted=budget.interrupted,
            searches=scene.cache.searches,
        )

    return PendingChoice(scene, executor.submit(choose, scene.world.time, stop), ahead)


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
    there = np.flatnonzero(after[:, 0] < 0.5 * REMOVED)
    movables = world.movables.select(there).moved_to(after[there])
    moved = replace(world, robot_pose=push.end, robot_twist=np.zeros(3), movables=movables)
    return PushScene(moved, scene.config, scene.cache)


def no_penalty(push: Push) -> float:
    """Nothing."""
    return 0.0


def select_push(scene: PushScene, penalty: Callable[[Push], float] = no_penalty) -> PushChoice:
    """Sequence anew: the pushes to make, and the first of them with the route to it.

    Where no push home can be carried out, those that end on the way count as well, and where none
    of these can, drives that free an object: first for the nearest objects, then for all, with
    approaches on a finer lattice.

    Args:
        scene: the scene.
        penalty: what to add to the cost of a push [m].
    """
    choice = _select(scene, build_push_graph(scene, penalty), penalty)
    left = len(scene.left)
    for relocations, thorough in ((0, False), (min(_NEAREST, left), False), (left, True)):
        if choice.first is None and not scene.budget.is_used_up:
            if thorough:
                scene = scene.on_finer_lattice()
            graph = build_push_graph(
                scene, penalty, onward=True, relocations=relocations, thorough=thorough
            )
            choice = _select(scene, graph, penalty)
    return choice


def _select(scene: PushScene, graph: PushGraph, penalty: Callable[[Push], float]) -> PushChoice:
    """The cheapest order, with its first push simulated.

    It is simulated on the cheapest path, and if that spoils the push around its object.
    """
    known: dict[int, SimulatedPush] = {}
    around: dict[int, ApproachTree] = {}

    def simulated_cost(n: int) -> tuple[float, tuple[int, ...]] | None:
        if scene.budget.is_used_up and any(math.isfinite(one.cost) for one in known.values()):
            return None
        push = graph.pushes[n]
        target = scene.index_of(push.target)
        found = _simulated(scene, graph.approach, push, target)
        if found is None or not math.isfinite(found.cost):
            if target not in around:
                around[target] = approach_tree(scene, target)
            found = _simulated(scene, around[target], push, target) or found
        if found is None:
            return math.inf, ()
        known[n] = found
        scene.budget.cost = min(scene.budget.cost, found.cost)
        return found.cost + penalty(push), found.push.delivers

    order = sequence_pushes(graph, simulated_cost, scene.config.max_simulations)
    plan = tuple(graph.pushes[n] for n in order)
    return PushChoice(graph, plan, known[order[0]] if order else None)


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


def build_push_graph(
    scene: PushScene,
    penalty: Callable[[Push], float] = no_penalty,
    *,
    onward: bool = False,
    relocations: int = 0,
    thorough: bool = False,
) -> PushGraph:
    """Make the candidate pushes of a scene and their costs.

    Args:
        scene: the scene.
        penalty: what to add to the cost of a push [m].
        onward: whether pushes are wanted too that only bring an object nearer to its goal.
        relocations: for how many objects, the nearest ones first, drives that only bring them to
            where they can be pushed home from are wanted too.
        thorough: whether to look for ones that cost much more than the best one.
    """
    approach = approach_tree(scene)
    pushes = candidate_pushes(scene, approach, onward, relocations, thorough)
    row = least_costs(approach.costs, arrivals_at(scene.fine.grid, pushes))
    extra = np.array([penalty(push) for push in pushes])
    keep = _best(scene, pushes, row + extra)
    pushes = [pushes[n] for n in keep]
    row = row[keep]
    push_costs = np.array([push.cost for push in pushes]) + extra[keep]
    costs = np.zeros((1, 0))
    if pushes:
        costs = np.vstack([_between(scene, pushes), row[None]]) + push_costs[None]
    delivered = {i for n, push in enumerate(pushes) if np.isfinite(row[n]) for i in push.serves}
    infeasible = {
        i: "no push for it was found that the robot can get to"
        for i in scene.movables.ids[scene.left].tolist()
        if i not in delivered
    }
    return PushGraph(tuple(pushes), costs, approach, infeasible)


def candidate_pushes(
    scene: PushScene,
    approach: ApproachTree,
    onward: bool = False,
    relocations: int = 0,
    thorough: bool = False,
) -> list[Push]:
    """All candidates of a scene; the arguments are those of `build_push_graph`."""
    away = np.hypot(*(scene.poses[:, :2] - scene.world.robot_pose[:2]).T)
    objects = sorted(scene.left, key=lambda k: (float(away[k]), k))
    pushes = delivering_pushes(scene, objects)
    if onward:
        pushes += [push for k in objects for push in partial_pushes(scene, k)]
    for k in objects:
        if not relocations or scene.budget.is_used_up:
            break
        found = relocating_pushes(scene, k, approach, thorough)
        pushes += found
        relocations -= bool(found)
    return pushes


def _best(scene: PushScene, pushes: Sequence[Push], row: FloatArray) -> list[int]:
    """Indices of the best few pushes for each object, of those that the robot can get to."""
    keep: set[int] = set()
    shares = [max(1, len(push.delivers)) for push in pushes]
    order = sorted(
        (n for n in range(len(pushes)) if np.isfinite(row[n])),
        key=lambda n: (pushes[n].cost / shares[n], n),
    )
    near = sorted(order, key=lambda n: (row[n] + pushes[n].cost) / shares[n])
    ids = scene.movables.ids[scene.left].tolist()
    count = min(scene.config.per_object, max(2, scene.config.max_pushes // max(1, len(ids))))
    for i in ids:
        keep.update([n for n in order if i in pushes[n].serves][:count])
        keep.update([n for n in near if i in pushes[n].serves][: count // 2])
    return sorted(keep)


def _between(scene: PushScene, pushes: Sequence[Push]) -> FloatArray:
    """(N, N) cost of the approach from the end of each push to the start of each other [m].

    What cannot be got to from there, as far as one can say now, is put off rather than ruled out:
    otherwise one object would be enough for there to be no order at all.
    """
    grid = scene.coarse.grid
    ids = scene.movables.ids
    bounds = scene.world.static.bounds
    far = _FAR * float(np.hypot(*(bounds[2:] - bounds[:2])))
    arrivals = arrivals_at(grid, pushes)
    out = np.full((len(pushes), len(pushes)), far)
    known: dict[tuple[object, ...], FloatArray] = {}
    step = 2.0 * grid.step
    for n, push in enumerate(pushes):
        key = (
            push.delivers,
            *np.round(push.end[:2] / step).tolist(),
            round(float(push.end[2]) / 0.8),
        )
        if key not in known:
            if len(known) == _MOST_APPROACHES or scene.budget.is_over:
                continue
            weights = scene.config.later_fraction * scene.contact_weights
            weights[np.isin(ids, push.delivers)] = 0.0
            found = search_approaches(scene, scene.coarse, push.end, weights, arrivals.nodes)
            known[key] = least_costs(found.costs, arrivals)
        out[n] = np.minimum(known[key], far)
    np.fill_diagonal(out, np.inf)
    return out
