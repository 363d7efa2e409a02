"""`GtspMpc`: sequence, approach, push, look, sequence anew."""

from __future__ import annotations

import math
from collections import Counter
from functools import partial
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock, PoseFollower, Retreat
from pushplan.motion.recovery_path import recovery_path
from pushplan.planners.rearrangement.push import Push, signature
from pushplan.planners.rearrangement.push_execution import ExecutionEnd, PushExecution
from pushplan.planners.rearrangement.push_graph import PushGraph
from pushplan.planners.rearrangement.push_scene import PushScene, check_world
from pushplan.planners.rearrangement.push_selection import select_push
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.world import InvalidInputError, Twist, World
from pushplan.world.checks import FloatArray, expect


class GtspMpc:
    """Clears or delivers objects: which next, from which side, together with which others.

    After every push the push graph is built anew from what is seen, and the order of pushes
    solved anew; the first of them is carried out. No chance is involved.

    Args:
        config: settings.
        overrides: fields of the default config to change, in place of ``config``.

    Attributes:
        given_up: why nothing more is tried with an object, by id.
        plan: the pushes planned last, in order.
        graph: the graph that they come from.
    """

    actions = ("velocity",)

    def __init__(self, config: RearrangementConfig | None = None, **overrides: Any) -> None:
        if config is not None and overrides:
            raise InvalidInputError("give either a config or fields of one, not both")
        if config is None:
            config = RearrangementConfig.of(**overrides)
        self.config = expect("config", config, RearrangementConfig)
        self._forget()

    def _forget(self) -> None:
        self._execution: PushExecution | None = None
        self._away: Retreat | PoseFollower | None = None
        self._cache = RolloutCache()
        self._failures: Counter[tuple[object, ...]] = Counter()
        self._relocations: Counter[int] = Counter()
        self._left, self._rounds, self._stuck = -1, 0, 0
        self._recovered_from: FloatArray | None = None
        self._stopped_at: PushScene | None = None
        self._clock = EpisodeClock(self.config.response)
        self.given_up: dict[int, str] = {}
        self.plan: tuple[Push, ...] = ()
        self.graph: PushGraph | None = None

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        self._forget()

    def warm_up(self) -> None:
        """Load the kernels that an episode may need."""
        from pushplan.planners.rearrangement import kernel_warmup

        kernel_warmup.warm_up_rearrangement()
        kernel_warmup.drive_in_small_worlds(GtspMpc)

    def act(self, world: World, observation: Any = None) -> Twist:
        """The velocity for this step; stops when nothing is left to be done.

        Raises:
            InvalidInputError: if the goal is one for the robot, or the robot cannot stop.
        """
        check_world(world)
        return self._clock.command_for(world, self._act)

    def _act(self, world: World) -> Twist:
        scene = PushScene(world, self.config, self._cache)
        left = int((~scene.done).sum())
        if left != self._left:  # something was done, or has come back
            self._left, self._rounds, self._stopped_at = left, 0, None
            self._relocations.clear()
            self._failures = Counter(
                {key: min(n, self.config.max_failures - 1) for key, n in self._failures.items()}
            )
        if not left:
            self._execution, self.given_up, self.plan = None, {}, ()
            return Twist(0.0, 0.0)
        if self._stopped_at is not None and _alike(scene, self._stopped_at):
            return Twist(0.0, 0.0)
        searched, held = False, self._clock.held
        for _ in range(4):  # jobs that end at once
            if self._away is not None:
                away = self._away.command(world.robot_pose, world.time, held)
                if away is not None:
                    return away
                self._away = None
            if self._execution is None:
                if searched or not self._choose(scene):  # one search a step is enough
                    break
                searched = True
            if self._execution is not None:
                command = self._execution.command(scene, held)
                if isinstance(command, Twist):
                    return command
                self._close(scene, self._execution, command)
        return Twist(0.0, 0.0)

    def _choose(self, scene: PushScene) -> bool:
        """Take up the best push, or else leave a tight place; whether there is anything to do."""
        self._cache.age()
        chosen = select_push(scene, partial(self._penalty, scene.size))
        self.graph, self.plan = chosen.graph, chosen.plan
        self.given_up = dict(chosen.graph.infeasible)
        if chosen.first is not None:
            push, route = chosen.first.push, chosen.first.route
            predictive = self.config.mpc and signature(push) not in self._failures
            self._execution = PushExecution(
                scene.world, push, route, self.config.response, predictive=predictive
            )
            return True
        path = recovery_path(scene.world, 0.5 * self.config.margin * scene.size)
        here, before = scene.world.robot_pose, self._recovered_from
        moved = before is None or bool(np.abs(before - here).max() > 0.02 * scene.size)
        if path is not None and moved:
            self._recovered_from = here
            self._away = PoseFollower(scene.world.robot, path, self.config.response)
            return True
        if self._failures and self._rounds < self.config.max_rounds:
            self._failures.clear()
            self._rounds += 1
            return True
        if self._cache.searches < self.config.max_searches:  # else the search goes on
            self._stopped_at = scene
        return False

    def _penalty(self, size: float, push: Push) -> float:
        """What is added to the cost of a push for what has failed [m]."""
        failures, config = self._failures[signature(push)], self.config
        relocations = self._relocations[push.target] if push.relocates else 0
        if failures >= config.max_failures or relocations >= config.max_relocations:
            return math.inf
        cost = failures * config.failure_cost + relocations * config.relocation_cost
        return cost * size

    def _close(self, scene: PushScene, execution: PushExecution, end: ExecutionEnd) -> None:
        """Draw the conclusions from how an execution ended."""
        self._execution, push = None, execution.push
        if end is ExecutionEnd.DONE and not push.relocates:
            self._stuck = 0
            return
        if end is not ExecutionEnd.OBSOLETE:  # also a relocation, so that another comes next
            self._failures[signature(push)] += 1
        if end is ExecutionEnd.DONE:  # what has failed before may succeed from here
            self._relocations[push.target] += 1
            self._failures = Counter(
                {
                    key: count
                    for key, count in self._failures.items()
                    if key[0] != push.target or key[1] == push.controller
                }
            )
        if end is ExecutionEnd.STUCK:
            robot, pose = scene.world.robot, scene.world.robot_pose
            self._away = Retreat(robot, pose, self.config.retreat * scene.size, self._stuck)
            self._stuck += 1


def _alike(one: PushScene, other: PushScene) -> bool:
    """Whether nothing has moved in between."""
    same = np.array_equal(one.world.movables.ids, other.world.movables.ids)
    return same and bool(np.hypot(*(one.poses - other.poses)[:, :2].T).max() < 0.05 * one.size)
