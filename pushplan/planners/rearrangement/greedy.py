"""`GreedyPusher`: the nearest box that is not done, pushed straight towards its goal. The grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock, LegFollower, Recovery
from pushplan.control.recovery import warm_up_recovery
from pushplan.planners.rearrangement.geometric_pusher import GeometricPusher
from pushplan.planners.rearrangement.line_up import line_up
from pushplan.planners.rearrangement.path_push import PathPush
from pushplan.planners.rearrangement.push_scene import PushScene, check_world
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import Twist, World
from pushplan.world.checks import expect

_OPTIONS = 8  # how many places to push a box from are tried before the first comes again
_RETREAT = 0.6  # how far the robot backs off after a push [circumscribed radii]
_WAIT = 1.5  # time after which it looks again where it can get at no box [s]


@dataclass
class _Attempt:
    """One push: of which box, how the robot gets behind it, and whether it is there."""

    box: int
    driver: LegFollower
    push: PathPush
    pushing: bool = False


class GreedyPusher:
    """Takes the nearest box that is not done, drives behind it and pushes until it is done.

    Behind means opposite to the box's shortest path around static things to its goal; where the
    robot does not fit there it stands aside or begins at an angle, beside a wall for instance.
    Other boxes are not looked at. A box that cannot be got at or got on with is put off until the
    others have had their turn. No chance is involved.

    Args:
        config: settings; of these, ``slack`` and ``response`` count.
    """

    actions = ("velocity",)
    goal_kind = "objects"

    def __init__(self, config: RearrangementConfig | None = None) -> None:
        self.config = expect("config", config or RearrangementConfig(), RearrangementConfig)
        self._forget()

    def _forget(self) -> None:
        self._attempt: _Attempt | None = None
        self._failures: dict[int, int] = {}
        self._away: Recovery | None = None
        self._wait_until = -math.inf
        self._clock = EpisodeClock(self.config.response)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        self._forget()

    def warm_up(self) -> None:
        """Load the kernels that an episode may need."""
        from pushplan.planners.rearrangement import kernel_warmup

        warm_up_recovery()
        kernel_warmup.drive_in_small_worlds(GreedyPusher)

    def act(self, world: World, observation: Any = None) -> Twist:
        """The velocity for this step; stops when every box is done.

        Raises:
            InvalidInputError: if the goal is one for the robot, or the robot cannot stop.
        """
        check_world(world)
        return self._clock.command_for(world, self._act)

    def _act(self, world: World) -> Twist:
        command = self._retreat(world) or self._work(PushScene(world, self.config))
        return command or self._retreat(world) or Twist(0.0, 0.0)

    def _work(self, scene: PushScene) -> Twist | None:
        """The next command of the attempt in hand or of a new one; None where it has ended."""
        world, response = scene.world, self.config.response
        self._attempt = attempt = self._attempt or self._choose(scene)
        if attempt is None:
            return None
        done = attempt.box not in world.movables.ids[~scene.done]
        command = None if done else self._drive(attempt, scene)
        if command is None:
            if not done:  # it is the box's fault, which comes last from now on
                self._failures[attempt.box] = self._failures.get(attempt.box, 0) + 1
            self._attempt = None
            self._away = Recovery(world, _RETREAT * scene.size, response=response, looks=False)
        return command

    def _drive(self, attempt: _Attempt, scene: PushScene) -> Twist | None:
        """Get behind the box, and then push it; None where that fails."""
        if not attempt.pushing:
            pose, time = scene.world.robot_pose, scene.world.time
            command = attempt.driver.command(pose, time, self._clock.held)
            attempt.pushing = attempt.driver.arrived
            if not attempt.pushing:
                return command
        return attempt.push.command(scene)

    def _choose(self, scene: PushScene) -> _Attempt | None:
        """The nearest box that the robot can get behind, of those that failed least often."""
        world, failures = scene.world, self._failures
        if world.time < self._wait_until:
            return None
        left = np.flatnonzero(~scene.done).tolist()
        away = np.hypot(*(scene.poses[:, :2] - world.robot_pose[:2]).T)
        ids = world.movables.ids.tolist()
        for k in sorted(left, key=lambda k: (failures.get(ids[k], 0), away[k], k)):
            skip = failures.get(ids[k], 0) % _OPTIONS
            place = line_up(scene, k, skip)
            if place is not None:
                driver = LegFollower(world.robot, place.legs, response=self.config.response)
                pusher = GeometricPusher(scene.controller, place.shift)
                return _Attempt(ids[k], driver, PathPush(scene, ids[k], place.path, pusher))
            failures[ids[k]] = failures.get(ids[k], 0) + 1
        self._wait_until = world.time + _WAIT
        return None

    def _retreat(self, world: World) -> Twist | None:
        """Get away from where the last attempt ended."""
        command = None if self._away is None else self._away.command(world, self._clock.held)
        if command is None:
            self._away = None
        return command
