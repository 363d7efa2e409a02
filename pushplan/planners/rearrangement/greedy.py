"""`GreedyPusher`: the nearest box that is not done, pushed straight towards its goal. The grid."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock, LegFollower, Legs, Recovery, StallChecker
from pushplan.control.limits import arc_twist
from pushplan.control.recovery import warm_up_recovery
from pushplan.planners.arguments import check_pusher
from pushplan.planners.rearrangement.line_up import (
    LineUp,
    bumper_half,
    goal_heading,
    is_done,
    line_up,
    unit,
)
from pushplan.world import Twist, World
from pushplan.world.checks import FloatArray, expect, number

_OPTIONS = 8  # how many directions to push a box are tried before the first comes again
_ASTRAY = 0.8  # difference between heading and push at which the robot lines up anew [rad]


@dataclass(frozen=True)
class GreedyConfig:
    """Settings of `GreedyPusher`. Lengths are in units of the robot's circumscribed radius.

    Args:
        response: time in which an error of heading or place is driven off [s]; longer than the
            robot's delay.
        slack: clearance between bumper and box when the robot lines up.
        retreat: how far it backs off after a push.
        detour: how far it pushes in a direction other than that of the shortest path.
        offset: distance from the line of push at which it lines up anew, as a fraction of half the
            bumper's width.
        patience: time without moving after which it gives up [s].
    """

    response: float = 0.2
    slack: float = 0.08
    retreat: float = 0.6
    detour: float = 1.5
    offset: float = 0.7
    patience: float = 1.5

    def __post_init__(self) -> None:
        for item in fields(self):
            number(f"greedy {item.name}", getattr(self, item.name), low=0.0, open_low=True)


@dataclass
class _Attempt:
    """One push: of which box, how, and where it began (None before that)."""

    box: int
    push: LineUp
    driver: LegFollower
    heading: float
    begun_at: FloatArray | None = None


class GreedyPusher:
    """Takes the nearest box that is not done, drives behind it and pushes until it is done.

    Behind means opposite to the box's shortest path around static things to its goal; where the
    robot does not fit there it stands aside or pushes at an angle, along a wall for instance.
    Other boxes are not looked at. A box that cannot be got at or got on with is put off until the
    others have had their turn. No chance is involved.

    Args:
        config: settings.
    """

    actions = ("velocity",)

    def __init__(self, config: GreedyConfig | None = None) -> None:
        self.config = expect("config", config or GreedyConfig(), GreedyConfig)
        self._forget()

    def _forget(self) -> None:
        self._attempt: _Attempt | None = None
        self._failures: dict[int, int] = {}
        self._away: Recovery | None = None
        self._stall: StallChecker | None = None
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
        check_pusher(world, "the greedy pusher")
        return self._clock.command_for(world, self._act)

    def _act(self, world: World) -> Twist:
        if self._attempt is not None and self._is_over(world, self._attempt):
            self._attempt = None
            self._back_off(world)
        command = self._retreat(world) or self._work(world)
        return command or self._retreat(world) or Twist(0.0, 0.0)

    def _work(self, world: World) -> Twist | None:
        """The next command of the attempt in hand or of a new one; None where it has ended."""
        if self._attempt is None and world.time >= self._wait_until:
            self._attempt = self._choose(world)
            self._wait_until = world.time + (self.config.patience if self._attempt is None else 0.0)
        attempt = self._attempt
        if attempt is None:
            return None
        if attempt.begun_at is None:
            command = attempt.driver.command(world.robot_pose, world.time, self._clock.held)
            if command is not None:
                return command
            if attempt.driver.arrived:
                attempt.begun_at = world.robot_pose
                self._stall = StallChecker(world.robot, self.config.patience)
        sound = attempt.begun_at is not None and not self._is_stuck(world)
        command = self._push(world, attempt) if sound else None
        if command is not None and self._stall is not None:
            self._stall.send(command)
        if command is None:
            if not sound:  # it is the box's fault, which comes last from now on
                self._failures[attempt.box] = self._failures.get(attempt.box, 0) + 1
            self._attempt = None
            self._back_off(world)
        return command

    def _is_over(self, world: World, attempt: _Attempt) -> bool:
        k = np.flatnonzero(world.movables.ids == attempt.box)
        return len(k) == 0 or is_done(world, int(k[0]))

    def _choose(self, world: World) -> _Attempt | None:
        """The nearest box that the robot can get behind, of those that failed least often."""
        boxes = world.movables
        left = [k for k in range(len(boxes)) if not is_done(world, k)]
        away = np.hypot(*(boxes.poses[:, :2] - world.robot_pose[:2]).T)
        ids = boxes.ids.tolist()
        slack = self.config.slack * world.robot.circumscribed_radius
        for k in sorted(left, key=lambda k: (self._failures.get(ids[k], 0), away[k], k)):
            push = line_up(world, k, slack, skip=self._failures.get(ids[k], 0) % _OPTIONS)
            if push is not None:
                legs = Legs.ahead(push.points)
                driver = LegFollower(world.robot, legs, response=self.config.response)
                return _Attempt(ids[k], push, driver, push.heading)
            self._failures[ids[k]] = self._failures.get(ids[k], 0) + 1
        return None

    def _push(self, world: World, attempt: _Attempt) -> Twist | None:
        """Follow the line through the box towards its goal; None where the box has been lost."""
        k = int(np.flatnonzero(world.movables.ids == attempt.box)[0])
        robot, size, shift = world.robot, world.robot.circumscribed_radius, attempt.push.shift
        if attempt.push.turn == 0.0:
            heading = goal_heading(world, k)
            attempt.heading = attempt.heading if heading is None else heading
        elif _distance(world.robot_pose, attempt.begun_at) > self.config.detour * size:
            return None
        u, half = unit(attempt.heading), bumper_half(robot)
        gap = world.movables.poses[k, :2] - world.robot_pose[:2]
        error = math.remainder(attempt.heading - float(world.robot_pose[2]), 2.0 * math.pi)
        left = float(gap[0] * u[1] - gap[1] * u[0])  # robot left of the box [m]
        reach = float(robot.vertices[:, 0].max()) + world.movables.radii[k] + 0.3 * size
        lost = abs(left) > max(self.config.offset, abs(shift) + 0.25) * half
        if lost or abs(error) > _ASTRAY or not 0.0 < float(gap @ u) < reach:
            return None
        wanted = error - math.atan((left - shift * half) / size)
        return arc_twist(robot, size, 1.5 * wanted)

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

    def _is_stuck(self, world: World) -> bool:
        """Whether something stops the robot."""
        assert self._stall is not None
        return self._stall.update(world.robot_pose, world.time)


def _distance(a: FloatArray, b: FloatArray | None) -> float:
    assert b is not None
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))
