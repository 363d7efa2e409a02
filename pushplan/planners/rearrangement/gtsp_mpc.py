"""`GtspMpc`: sequence, approach, push, look, sequence anew."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock, PoseFollower, Retreat
from pushplan.motion.recovery_path import recovery_path
from pushplan.planners.rearrangement.greedy import GreedyPusher
from pushplan.planners.rearrangement.push import Push, signature
from pushplan.planners.rearrangement.push_execution import ExecutionEnd, PushExecution
from pushplan.planners.rearrangement.push_graph import PushGraph
from pushplan.planners.rearrangement.push_scene import PushScene, check_world
from pushplan.planners.rearrangement.push_selection import select_push
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.world import InvalidInputError, Twist, World
from pushplan.world.checks import FloatArray, expect

_FALLBACK = 45.0
"""How long the fallback works where nothing is found [times in which the robot drives a
circumscribed radius and turns by half a radian]."""
_TRIES = 6  # how often it does so without progress before what is left is given up
_RETREAT = 0.3  # how far it backs off where it is stuck [circumscribed radii]
_PENALTY = 3.0  # what is added to the cost of a push that has failed [circumscribed radii]
_TABU_AFTER = 3  # after so many failures a push is tabu until something else has been done


class GtspMpc:
    """Clears or delivers objects: which next, from which side, together with which others.

    After every push the push graph is built anew from what is seen, and the order of pushes
    solved anew; the first of them is carried out. Where no push is found, a `GreedyPusher` works
    until one more object is done. No chance is involved.

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
        self._optimistic_config = replace(config, static_friction=0.0)
        self._forget()

    def _forget(self) -> None:
        self._execution: PushExecution | None = None
        self._caches = RolloutCache(), RolloutCache()
        self._optimistic = False
        self._penalties: dict[tuple[object, ...], float] = {}
        self._tabu: set[tuple[object, ...]] = set()
        self._failures = 0
        self._recovery: PoseFollower | None = None
        self._recovered_from: FloatArray | None = None
        self._retreat: Retreat | None = None
        self._clock = EpisodeClock(self.config.response)
        self._fallback = GreedyPusher()
        self._fallback_until, self._left, self._no_progress = -math.inf, -1, 0
        self._stopped_at: PushScene | None = None
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
        scene = self._scene(world)
        left = int((~scene.done).sum())
        if left != self._left:  # something was done, or has come back
            self._left, self._no_progress, self._fallback_until = left, 0, -math.inf
            self._stopped_at, self._optimistic = None, False
            self._tabu.clear()
            for cache in self._caches:
                cache.searches = 0
        if not left:
            self._execution, self.given_up, self.plan = None, {}, ()
            return Twist(0.0, 0.0)
        if self._stopped_at is not None and _alike(scene, self._stopped_at):
            return Twist(0.0, 0.0)
        if world.time < self._fallback_until:
            return self._fallback.act(world)
        return self._decide(scene) or self._fall_back(scene)

    def _scene(self, world: World) -> PushScene:
        """The scene to plan in; in the optimistic model objects slide along walls."""
        if self._optimistic:
            return PushScene(world, self._optimistic_config, self._caches[1])
        return PushScene(world, self.config, self._caches[0])

    def _decide(self, scene: PushScene) -> Twist | None:
        """The next command of a push; None if none is found."""
        world, chosen, held = scene.world, None, self._clock.held
        for _ in range(4):
            if self._retreat is not None:
                away = self._retreat.command(world.robot_pose, world.time, held)
                if away is not None:
                    return away
                self._retreat = None
            if self._recovery is not None:
                recovering = self._recovery.command(world.robot_pose, world.time, held)
                if recovering is not None:
                    return recovering
                self._recovery = None
            if self._execution is None:
                if chosen is not None:  # one search a step is enough
                    break
                self._caches[self._optimistic].age()
                tabu = dict.fromkeys(self._tabu, math.inf)
                chosen = select_push(scene, self._penalties | tabu)
                self.graph, self.plan = chosen.graph, chosen.plan
                self.given_up = dict(chosen.graph.infeasible)
                if chosen.first is None:
                    return self._recover(scene)
                push = chosen.first.push
                self._execution = PushExecution(
                    world,
                    push,
                    chosen.first.route,
                    self.config.response,
                    predictive=self.config.mpc and signature(push) not in self._penalties,
                )
            command = self._execution.command(scene, held)
            if isinstance(command, Twist):
                return command
            self._close(scene, self._execution, command)
        return Twist(0.0, 0.0)

    def _recover(self, scene: PushScene) -> Twist | None:
        """Without a push: get out of a tight place, or else plan with the optimistic model."""
        margin = 0.5 * self.config.margin * scene.size
        here, path = scene.world.robot_pose, recovery_path(scene.world, margin)
        tried = self._recovered_from is not None and bool(
            np.abs(self._recovered_from - here).max() < 0.02 * scene.size
        )
        if path is not None and not tried:  # else it has not moved since
            self._recovered_from = here
            self._recovery = PoseFollower(scene.world.robot, path, self.config.response)
            return self._recovery.command(here, scene.world.time, self._clock.held)
        self._optimistic = not self._optimistic
        return Twist(0.0, 0.0) if self._optimistic else None

    def _close(self, scene: PushScene, execution: PushExecution, end: ExecutionEnd) -> None:
        """Draw the conclusions from how an execution ended."""
        self._execution = None
        if end is ExecutionEnd.DONE and not execution.push.pre_relocates:
            self._failures = 0
            return
        if end is not ExecutionEnd.OBSOLETE:  # also a pre-relocation, so that another comes next
            key = signature(execution.push)
            penalty = self._penalties[key] = self._penalties.get(key, 0.0) + _PENALTY * scene.size
            if penalty > (_TABU_AFTER - 0.5) * _PENALTY * scene.size:
                self._tabu.add(key)
        if end is ExecutionEnd.STUCK:
            self._failures += 1
            pose = scene.world.robot_pose
            self._retreat = Retreat(
                scene.world.robot, pose, _RETREAT * scene.size, self._failures - 1
            )

    def _fall_back(self, scene: PushScene) -> Twist:
        """Let the greedy pusher work for a while; stop where that has made no progress either."""
        world, ids = scene.world, scene.world.movables.ids
        if self._no_progress >= _TRIES:
            why = "neither a push for it was found, nor has simple pushing moved it on"
            self.given_up = {int(i): why for i in ids[~scene.done]}
            self._stopped_at = scene
            return Twist(0.0, 0.0)
        if self._no_progress == 0:
            self._penalties.clear()
            self._tabu.clear()
        self._no_progress += 1
        robot = world.robot
        seconds = scene.size / robot.max_speed + 0.5 / robot.max_turn_rate
        self._fallback_until = world.time + _FALLBACK * seconds
        return self._fallback.act(world)


def _alike(one: PushScene, other: PushScene) -> bool:
    """Whether nothing has moved in between."""
    same = np.array_equal(one.world.movables.ids, other.world.movables.ids)
    return same and bool(np.hypot(*(one.poses - other.poses)[:, :2].T).max() < 0.05 * one.size)
