"""`PushExecution`: one push in hand: drive there, look again, push, and know when it ends."""

from __future__ import annotations

import enum
import math

import numpy as np

from pushplan.control import clamp_twist
from pushplan.planners.rearrangement.controller_kernels import steer_push
from pushplan.planners.rearrangement.mpc_follower import MpcFollower, suits_mpc
from pushplan.planners.rearrangement.pose_follower import PoseFollower
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.route import Route
from pushplan.planners.rearrangement.route_follower import RouteFollower
from pushplan.world import Twist, World
from pushplan.world.checks import FloatArray

_PATIENCE = 4  # commands without motion after which the robot counts as stuck


class ExecutionEnd(enum.Enum):
    """How an execution ended."""

    DONE = "done"
    """What it was for is where it belongs, or has been pre-relocated."""
    FAILED = "failed"
    """The push did not do what it was for."""
    STUCK = "stuck"
    """The robot could not move on."""
    OBSOLETE = "obsolete"
    """There is nothing left to push."""


class PushExecution:
    """Carries out one push.

    Args:
        world: the snapshot in which it begins.
        push: the push.
        route: to its start.
        period: time between two commands [s].
        predictive: whether to push by predictive control where that suits.

    Attributes:
        push: the push, as predicted last.
        route: to its start.
        pushing: whether the push itself has begun.
    """

    def __init__(
        self, world: World, push: Push, route: Route, period: float, *, predictive: bool = True
    ) -> None:
        self.push, self.route, self.pushing = push, route, False
        self._predictive = predictive
        self._route_follower = RouteFollower(world.robot, route, period)
        self._mpc_follower: MpcFollower | None = None
        self._pose_follower: PoseFollower | None = None
        self._driven = self._reached = self._commanded = 0.0
        self._last: FloatArray | None = None
        self._still = 0

    def command(self, scene: PushScene) -> Twist | ExecutionEnd:
        """The velocity to drive now, or how it ended."""
        world, period = scene.world, scene.config.period
        if self._is_stuck(world):
            return ExecutionEnd.STUCK
        twist: Twist | ExecutionEnd | None = None
        if not self.pushing:
            if self._is_obsolete(scene):
                return ExecutionEnd.OBSOLETE
            twist = self._route_follower.command(world.robot_pose)
            if twist is None:
                twist = self._begin(scene)
        if twist is None:
            twist = self._push(scene)
        if isinstance(twist, Twist):
            radius = world.robot.circumscribed_radius
            self._commanded = period * (abs(twist.linear) + abs(twist.angular) * radius)
            self._last = world.robot_pose
        return twist

    def _is_obsolete(self, scene: PushScene) -> bool:
        """Whether the object to be pushed has gone, or is where it belongs already."""
        target = np.flatnonzero(scene.world.movables.ids == self.push.target)
        return not len(target) or bool(scene.done[target[0]])

    def _begin(self, scene: PushScene) -> ExecutionEnd | None:
        """Look again at what the push would do from here."""
        push, world = self.push, scene.world
        ends = PushSimulator(scene).resimulate(push, world.robot_pose)
        good = [end for end in ends if push.pre_relocates or set(push.delivers) & set(end.delivers)]
        if not good:
            return ExecutionEnd.FAILED
        self.push = max(
            good, key=lambda end: (len(set(end.delivers) & set(push.delivers)), -end.length)
        )
        self.pushing, self._still = True, 0
        if self.push.is_primitive:
            self._pose_follower = PoseFollower(world.robot, self.push.poses, scene.config.period)
        if self._predictive and suits_mpc(scene, self.push):
            self._mpc_follower = MpcFollower(scene, self.push)
        return None

    def _push(self, scene: PushScene) -> Twist | ExecutionEnd:
        push, world, pose = self.push, scene.world, scene.world.robot_pose
        ids = world.movables.ids
        left = np.isin(ids, push.delivers) & ~scene.done
        if not push.pre_relocates and not left.any():
            return ExecutionEnd.DONE
        if self._pose_follower is not None:
            return self._pose_follower.command(pose) or ExecutionEnd.DONE
        if self._last is not None:
            self._driven += math.dist(pose[:2], self._last[:2])
        longest = push.length if push.pre_relocates else 1.1 * push.length + 0.4 * scene.size
        if self._driven > longest - 1e-6:
            return ExecutionEnd.DONE if push.pre_relocates else ExecutionEnd.FAILED
        controller = scene.controller._replace(gain=push.gain)
        target = np.flatnonzero((ids == push.target) & ~scene.done)
        step, turn = controller.step, 0.0
        if not push.follows_path:
            turn = _line_turn(push.start, pose, controller.size)
        elif len(target):
            box = np.array(scene.poses[target[0]])
            step, turn, self._reached, holds = steer_push(
                np.array(pose), box, push.object_path, self._reached, push.shift, controller
            )
            if not holds:
                return ExecutionEnd.FAILED
            if self._mpc_follower is not None:
                return self._mpc_follower.command(world) or ExecutionEnd.FAILED
        period = scene.config.period
        return clamp_twist(world.robot, step / period, turn / period)

    def _is_stuck(self, world: World) -> bool:
        """Whether the robot has hardly moved for some commands."""
        if self._last is not None and self._commanded > 0.0:
            pose, radius = world.robot_pose, world.robot.circumscribed_radius
            turned = abs(math.remainder(float(pose[2] - self._last[2]), 2.0 * math.pi))
            moved = math.dist(pose[:2], self._last[:2]) + turned * radius
            self._still = self._still + 1 if moved < 0.1 * self._commanded else 0
        return self._still >= _PATIENCE


def _line_turn(start: FloatArray, pose: FloatArray, size: float) -> float:
    """The turn [rad] that keeps the robot on the line of a push."""
    error = math.remainder(float(start[2] - pose[2]), 2.0 * math.pi)
    away = pose[:2] - start[:2]
    left = float(math.cos(start[2]) * away[1] - math.sin(start[2]) * away[0])
    return 0.5 * error - 0.3 * left / size
