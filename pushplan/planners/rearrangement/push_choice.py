"""`PushChoice`: what to do next, chosen in one planning call, perhaps for a later scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pushplan.motion.recovery_path import recovery_path
from pushplan.planners.rearrangement.goal_kernels import REMOVED
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_history import PushHistory
from pushplan.planners.rearrangement.push_poses import pose_distance
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_selection import Selection, select_push
from pushplan.planners.rearrangement.search_budget import SearchBudget
from pushplan.world import PendingResult, PlanningExecutor, Stop
from pushplan.world.checks import FloatArray
from pushplan.world.stop import wants_own_budget

_ROBOT, _OBJECT = 0.5, 0.2  # how far a scene may be from the predicted one [circumscribed radii]


@dataclass(frozen=True, eq=False)
class PushChoice:
    """What was chosen.

    Args:
        selection: the pushes, and the first of them with the route to it.
        way_out: (N, 3) poses out of a tight place, where there is no push; None if there are none.
        interrupted: whether a stop rule left something out of the search.
        searches: objects for which relocations were searched.
    """

    selection: Selection
    way_out: FloatArray | None
    interrupted: bool
    searches: int


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
        """Whether what was chosen is good for the scene that has come."""
        if not self.ahead:
            return True
        then, now, size = self.scene, scene, scene.size
        ids = now.world.movables.ids[~now.done]
        if not np.array_equal(ids, then.world.movables.ids[~then.done]):
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
    ahead: bool = False,
) -> PendingChoice:
    """Ask for the best push, or else a way out of a tight place.

    Args:
        scene: now, or where everything is expected to be.
        history: what has been tried; it is copied.
        executor: runs the search.
        stop: its stop rule; without one no more pushes than the config allows are simulated.
        ahead: whether the scene is still to come.
    """
    penalty = partial(history.copy().penalty, size=scene.size)

    def choose(rule: Stop | None) -> PushChoice:
        assert scene.cache is not None
        scene.cache.age()
        most = scene.config.max_rollouts if wants_own_budget(rule) else math.inf
        budget = SearchBudget(rule, most)
        selection = select_push(scene.with_budget(budget), penalty)
        margin = 0.5 * scene.config.margin * scene.size
        way_out = recovery_path(scene.world, margin) if selection.first is None else None
        return PushChoice(selection, way_out, budget.interrupted, scene.cache.searches)

    return PendingChoice(scene, executor.submit(choose, scene.world.time, stop), ahead)


def scene_after(scene: PushScene, push: Push) -> PushScene:
    """The scene that is expected at the end of a push."""
    world, after = scene.world, push.object_poses
    there = np.flatnonzero(after[:, 0] < 0.5 * REMOVED)
    movables = world.movables.select(there).moved_to(after[there])
    moved = replace(world, robot_pose=push.end, robot_twist=np.zeros(3), movables=movables)
    return PushScene(moved, scene.config, scene.cache)
