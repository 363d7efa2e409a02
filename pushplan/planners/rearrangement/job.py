"""`Job`: one push in hand: drive there, look again, push, and know when it ends."""

from __future__ import annotations

import enum
import math

import numpy as np

from pushplan.control import clamp_twist
from pushplan.planners.rearrangement.drive import LegDriver, PathTracer
from pushplan.planners.rearrangement.follow import BoxFollower, suits
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.rollout import guide
from pushplan.planners.rearrangement.route import Route
from pushplan.planners.rearrangement.runner import Runner
from pushplan.planners.rearrangement.scene import Scene
from pushplan.world import Twist, World
from pushplan.world.checks import FloatArray

_PATIENCE = 4
"""Commands without motion after which the robot counts as stuck."""


class JobEnd(enum.Enum):
    """How a job ended."""

    DONE = "done"
    """What it was for is where it belongs, or has been freed."""
    FAILED = "failed"
    """The push did not do what it was for."""
    STUCK = "stuck"
    """The robot could not move on."""
    MOOT = "moot"
    """There is nothing left to push."""


class Job:
    """Carries out one push.

    Args:
        world: the snapshot in which it begins.
        push: the push.
        route: the way to its start.
        period: time between two commands [s].
        predictive: whether to push by predictive control where that suits.

    Attributes:
        push: the push, as predicted last.
        route: the way to its start.
        pushing: whether the push itself has begun.
    """

    def __init__(
        self, world: World, push: Push, route: Route, period: float, *, predictive: bool = True
    ) -> None:
        self.push, self.route, self.pushing = push, route, False
        self._predictive = predictive
        self._driver = LegDriver(world.robot, route, period)
        self._follower: BoxFollower | None = None
        self._tracer: PathTracer | None = None
        self._driven = self._reached = self._asked = 0.0
        self._last: FloatArray | None = None
        self._still = 0

    def command(self, scene: Scene) -> Twist | JobEnd:
        """The velocity to drive now, or how the job ended."""
        world, period = scene.world, scene.config.period
        if self._is_stuck(world):
            return JobEnd.STUCK
        twist: Twist | JobEnd | None = None
        if not self.pushing:
            if self._is_moot(scene):
                return JobEnd.MOOT
            twist = self._driver.command(world.robot_pose)
            if twist is None:
                twist = self._begin(scene)
        if twist is None:
            twist = self._push(scene)
        if isinstance(twist, Twist):
            radius = world.robot.circumscribed_radius
            self._asked = period * (abs(twist.linear) + abs(twist.angular) * radius)
            self._last = world.robot_pose
        return twist

    def _is_moot(self, scene: Scene) -> bool:
        """Whether the object to be pushed has gone, or is where it belongs already."""
        led = np.flatnonzero(scene.world.movables.ids == self.push.led)
        return not len(led) or bool(scene.done[led[0]])

    def _begin(self, scene: Scene) -> JobEnd | None:
        """Look again at what the push would do from here."""
        push, world = self.push, scene.world
        ends = Runner(scene).again(push, world.robot_pose)
        good = [end for end in ends if push.frees or set(push.covers) & set(end.covers)]
        if not good:
            return JobEnd.FAILED
        self.push = max(
            good, key=lambda end: (len(set(end.covers) & set(push.covers)), -end.length)
        )
        self.pushing, self._still = True, 0
        if self.push.traced:
            self._tracer = PathTracer(world.robot, self.push.poses, scene.config.period)
        if self._predictive and suits(scene, self.push):
            self._follower = BoxFollower(scene, self.push)
        return None

    def _push(self, scene: Scene) -> Twist | JobEnd:
        push, world, pose = self.push, scene.world, scene.world.robot_pose
        ids = world.movables.ids
        left = np.isin(ids, push.covers) & ~scene.done
        if not push.frees and not left.any():
            return JobEnd.DONE
        if self._tracer is not None:
            return self._tracer.command(pose) or JobEnd.DONE
        if self._last is not None:
            self._driven += math.dist(pose[:2], self._last[:2])
        longest = push.length if push.frees else 1.1 * push.length + 0.4 * scene.size
        if self._driven > longest - 1e-6:
            return JobEnd.DONE if push.frees else JobEnd.FAILED
        law = scene.law._replace(gain=push.gain)
        led = np.flatnonzero((ids == push.led) & ~scene.done)
        step, turn = law.step, 0.0
        if not push.guided:
            turn = _along_line(push.start, pose, law.size)
        elif len(led):
            box = np.array(scene.poses[led[0]])
            step, turn, self._reached, holds = guide(
                np.array(pose), box, push.box_path, self._reached, push.shift, law
            )
            if not holds:
                return JobEnd.FAILED
            if self._follower is not None:
                return self._follower.command(world) or JobEnd.FAILED
        period = scene.config.period
        return clamp_twist(world.robot, step / period, turn / period)

    def _is_stuck(self, world: World) -> bool:
        """Whether the robot has hardly moved for some commands."""
        if self._last is not None and self._asked > 0.0:
            pose, radius = world.robot_pose, world.robot.circumscribed_radius
            turned = abs(math.remainder(float(pose[2] - self._last[2]), 2.0 * math.pi))
            moved = math.dist(pose[:2], self._last[:2]) + turned * radius
            self._still = self._still + 1 if moved < 0.1 * self._asked else 0
        return self._still >= _PATIENCE


def _along_line(start: FloatArray, pose: FloatArray, size: float) -> float:
    """The turn [rad] that keeps the robot on the line of a push."""
    error = math.remainder(float(start[2] - pose[2]), 2.0 * math.pi)
    away = pose[:2] - start[:2]
    left = float(math.cos(start[2]) * away[1] - math.sin(start[2]) * away[0])
    return 0.5 * error - 0.3 * left / size
