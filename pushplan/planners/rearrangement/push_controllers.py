"""The controllers that execute a push: along a line, along the object's path, or pose by pose."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from pushplan.control import EpisodeClock, PoseFollower, ProgressChecker, decrease_by
from pushplan.control.limits import arc_twist
from pushplan.core import rearrangement as core
from pushplan.planners.pushing import PushingConfig, PushingMpc, PushParameters, PushPath
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_starts import initial_heading
from pushplan.world import Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, expect

_MPC_HEADING = math.radians(20.0)
"""A push that begins farther off the object's path is left to the geometric controller."""
_PROGRESS = 0.05
"""Least progress of an object in the time in which the robot could drive a radius, or turn by
 `_TURN_PATIENCE` [circumscribed radii]."""
_TURN_PATIENCE = 0.15  # [rad]
_HEADING_GAIN = 0.5
_OFFSET_GAIN = 0.3  # [rad/m, times the circumscribed radius]
"""Parts of the errors from the line of a push that are steered off in each step."""

Pusher = Callable[[PushScene, float], Twist | None]
"""From the scene and for how long a command is held [s] to the velocity; None at the end."""


class GeometricPusher:
    """Pushes the object of a plan along its path, as fast as the robot can turn that way.

    It heads for a point ahead on the path, turned towards the side to which the object has slipped
    on the bumper. An object that has gone from the world was delivered: the robot drives straight
    on then, for what rides along.

    Args:
        controller: parameters.
        shift: how far the robot's middle is meant to be to the left of the object [m].

    Attributes:
        along: length of the path that the object has been pushed [m].
    """

    def __init__(self, controller: core.PushingController, shift: float = 0.0) -> None:
        self._controller = controller
        self._shift = shift
        self._clock = EpisodeClock(1.0)
        self._plan: Plan | None = None
        self.along = 0.0

    def reset(self, world: World) -> None:
        """See `pushplan.world.Controller`."""
        self._clock.reset()
        self._plan = None

    def command(self, world: World, plan: Plan) -> Twist:
        """See `pushplan.world.Controller`; the plan is one of `PushPath.plan`."""
        expect("plan", plan, Plan)
        world = expect("world", world, World)
        return self._clock.command_for(world, lambda _: self._follow(world, plan))

    def _follow(self, world: World, plan: Plan) -> Twist:
        if plan is not self._plan:
            self._plan = plan
            self.along = 0.0
            self._path = np.ascontiguousarray(plan.poses[:, :2])
        found = np.flatnonzero(world.movables.ids == plan.subtasks[0].object_ids[0])
        step = self._controller.step
        turn = 0.0
        if len(found):
            step, turn, self.along, _ = self._controller.steer_push(
                world.robot_pose,
                world.movables.poses[found[0]],
                self._path,
                self.along,
                self._shift,
            )
        return arc_twist(world.robot, step, turn)


class PathPush:
    """Pushes an object along a path while it stays on the bumper and makes progress.

    Args:
        robot: that pushes.
        target: id of the object.
        path: of its middle.
        pusher: chooses the velocities.
    """

    def __init__(
        self, robot: RobotModel, target: int, path: PushPath, pusher: GeometricPusher | PushingMpc
    ) -> None:
        self._plan = path.plan(robot, target)
        self._pusher = pusher
        size = robot.circumscribed_radius
        patience = max(size / robot.max_speed, _TURN_PATIENCE / robot.max_turn_rate)
        self._progress = ProgressChecker(decrease_by(_PROGRESS * size), patience)

    def command(self, scene: PushScene, held: float) -> Twist | None:
        """The velocity to drive now; None where the object has been lost or makes no progress.

        It goes on with an object that is done, for what rides along.
        """
        world = scene.world
        twist = self._pusher.command(world, self._plan)
        target = self._plan.subtasks[0].object_ids[0]
        remaining = self._plan.length - self._pusher.along
        for k in np.flatnonzero((world.movables.ids == target) & ~scene.done):
            holds = scene.controller.is_on_bumper(world.robot_pose, scene.poses[k])
            if not (holds and self._progress.update(remaining, world.time)):
                return None
        return twist


def make_pusher(scene: PushScene, push: Push, held: float, predictive: bool) -> Pusher:
    """The controller of a push, for its poses, its line or the path of its object.

    Args:
        scene: as the push begins.
        push: the push.
        held: for how long a command is held [s].
        predictive: push by predictive control where that suits.
    """
    config = scene.config
    world = scene.world
    if push.controller == "arc":
        follower = PoseFollower(world.robot, push.poses, config.response)
        return partial(_along_poses, follower)
    if push.controller == "line":
        return partial(_along_line, push.start)
    away = initial_heading(push.object_path, scene.controller.ahead) - float(world.robot_pose[2])
    straight = abs(math.remainder(away, math.tau)) < _MPC_HEADING
    # the contact model of `PushingMpc` is that of one object, along its path
    alone = not push.relocates and push.delivers == (push.target,)
    if predictive and alone and straight:
        path = PushPath.through(push.object_path, radius=scene.size)
        parameters = PushParameters(config.friction)
        mpc = PushingMpc(PushingConfig(parameters=parameters, period=held))
        return PathPush(world.robot, push.target, path, mpc).command
    path = PushPath.through(push.object_path)
    pusher = GeometricPusher(scene.controller.with_gain(push.gain), push.shift)
    return PathPush(world.robot, push.target, path, pusher).command


def _along_poses(follower: PoseFollower, scene: PushScene, held: float) -> Twist | None:
    return follower.drive(scene.world, held)


def _along_line(start: FloatArray, scene: PushScene, _: float) -> Twist:
    """The velocity that keeps the robot on the line of a push that began at a pose (3,)."""
    pose = scene.world.robot_pose
    error = math.remainder(float(start[2] - pose[2]), math.tau)
    away = pose[:2] - start[:2]
    left = float(math.cos(start[2]) * away[1] - math.sin(start[2]) * away[0])
    turn = _HEADING_GAIN * error - _OFFSET_GAIN * left / scene.size
    return arc_twist(scene.world.robot, scene.controller.step, turn)
