"""`GreedyPusher`: the nearest box that is not done, pushed straight towards its goal. The grid."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
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
from pushplan.world.checks import expect, number

_OPTIONS = 8  # how many places to push a box from are tried before the first comes again


@dataclass(frozen=True)
class GreedyConfig:
    """Settings of `GreedyPusher`. Lengths are in units of the robot's circumscribed radius.

    Args:
        response: time in which an error of heading or place is driven off [s]; longer than the
            robot's delay.
        slack: clearance between bumper and box when the robot lines up.
        retreat: how far it backs off after a push.
        patience: time after which it looks again where it can get at no box [s].
    """

    response: float = 0.2
    slack: float = 0.08
    retreat: float = 0.6
    patience: float = 1.5

    def __post_init__(self) -> None:
        for item in fields(self):
            number(f"greedy {item.name}", getattr(self, item.name), low=0.0, open_low=True)


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
        config: settings.
    """

    actions = ("velocity",)

    def __init__(self, config: GreedyConfig | None = None) -> None:
        self.config = expect("config", config or GreedyConfig(), GreedyConfig)
        self._settings = RearrangementConfig(slack=self.config.slack)
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
        scene = PushScene(world, self._settings)
        left = world.movables.ids[~scene.done]
        if self._attempt is not None and self._attempt.box not in left:
            self._attempt = None
            self._back_off(world)
        command = self._retreat(world) or self._work(scene)
        return command or self._retreat(world) or Twist(0.0, 0.0)

    def _work(self, scene: PushScene) -> Twist | None:
        """The next command of the attempt in hand or of a new one; None where it has ended."""
        world = scene.world
        if self._attempt is None and world.time >= self._wait_until:
            self._attempt = self._choose(scene)
            self._wait_until = world.time + (self.config.patience if self._attempt is None else 0.0)
        attempt = self._attempt
        if attempt is None:
            return None
        command = None
        if not attempt.pushing:
            command = attempt.driver.command(world.robot_pose, world.time, self._clock.held)
            attempt.pushing = attempt.driver.arrived
        over = attempt.push.remaining <= 0.0
        if attempt.pushing and not over:
            command = attempt.push.command(scene)
        if command is None:
            if not over:  # it is the box's fault, which comes last from now on
                self._failures[attempt.box] = self._failures.get(attempt.box, 0) + 1
            self._attempt = None
            self._back_off(world)
        return command

    def _choose(self, scene: PushScene) -> _Attempt | None:
        """The nearest box that the robot can get behind, of those that failed least often."""
        world, failures = scene.world, self._failures
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
        return None

    def _back_off(self, world: World) -> None:
        far = self.config.retreat * world.robot.circumscribed_radius
        response = self.config.response
        self._away = Recovery(world, far, response=response, looks=False)

    def _retreat(self, world: World) -> Twist | None:
        """Get away from where the last attempt ended."""
        command = None if self._away is None else self._away.command(world, self._clock.held)
        if command is None:
            self._away = None
        return command
