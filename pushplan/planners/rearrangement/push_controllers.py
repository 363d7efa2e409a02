"""`PushExecution` carries out one push, by one of three controllers."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from functools import partial

import numpy as np

from pushplan.control import (
    EpisodeClock,
    LegFollower,
    PoseFollower,
    ProgressChecker,
    StallChecker,
    decrease_by,
)
from pushplan.control.limits import arc_twist
from pushplan.core import rearrangement as core
from pushplan.planners.pushing import PushingConfig, PushingMpc, PushParameters, PushPath
from pushplan.planners.rearrangement.approach import Route
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import resimulate
from pushplan.planners.rearrangement.push_starts import initial_heading
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import PendingResult, Plan, PlanningExecutor, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, IntArray, expect

_MPC_HEADING = math.radians(20.0)
"""A push that begins farther off the object's path is left to the geometric controller."""
_PROGRESS = 0.05
"""Least progress of an object in the time in which the robot could drive a radius, or turn by
 `_TURN_PATIENCE` [circumscribed radii]."""
_TURN_PATIENCE = 0.15  # [rad]
_HEADING_GAIN = 0.5
_OFFSET_GAIN = 0.3  # [rad/m, times the circumscribed radius]
"""Parts of the errors from the line of a push that are steered off in each step."""
_ALIGNED = math.radians(0.4)  # error of a heading that is left where a push begins
_PLACED = 0.004  # error of the place that is left where a push begins [circumscribed radii]
_LONGER = 1.1
_FARTHER = 0.4
"""A push home has failed that is longer than predicted by this factor and by this distance
[circumscribed radii]."""

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


class ExecutionEnd(enum.Enum):
    """Outcome of an execution."""

    DONE = "done"
    """The target is where it belongs, or has been relocated."""
    FAILED = "failed"
    """The push did not do what it was for."""
    STUCK = "stuck"
    """The robot could not move on."""
    OBSOLETE = "obsolete"
    """There is nothing left to push."""


class PushExecution:
    """Carries out one push.

    Args:
        push: the push.
        route: to its start.
        robot: its limits.
        config: settings.
        executor: runs the prediction of the push from where the route has led to.
        predictive: push by predictive control where that suits.

    Attributes:
        push: the push, as predicted last.
        route: to its start.
        pushing: the push itself has begun.
        ids: (K,) of the objects that the prediction of the push is about.
        asked_for_next: what comes after it has been asked for.
    """

    def __init__(
        self,
        push: Push,
        route: Route,
        robot: RobotModel,
        config: RearrangementConfig,
        executor: PlanningExecutor,
        *,
        predictive: bool = True,
    ) -> None:
        self.push = push
        self.route = route
        self.pushing = False
        self.ids: IntArray = np.zeros(0, dtype=np.int64)
        self.asked_for_next = False
        self._executor = executor
        self._predictive = predictive
        self._prediction: PendingResult[list[Push]] | None = None
        self._route_follower = LegFollower(
            robot,
            route,
            near=_PLACED * robot.circumscribed_radius + config.position_noise,
            aligned=_ALIGNED + config.heading_noise,
            response=config.response,
        )
        self._pusher: Pusher | None = None
        self._stall = StallChecker(robot)
        self._driven = 0.0
        self._sent_at = self._speed = 0.0

    def command(self, scene: PushScene, held: float) -> Twist | ExecutionEnd:
        """The velocity to drive now, or how it ended.

        Args:
            scene: as it is now.
            held: for how long the command will be held [s].
        """
        world = scene.world
        if not self.pushing:
            target = world.movables.ids == self.push.target
            if not target.any() or scene.done[target][0]:
                return ExecutionEnd.OBSOLETE
            approach = self._route_follower
            twist = approach.command(world.robot_pose, world.time, held)
            if twist is not None:
                return twist
            if not approach.arrived:
                return ExecutionEnd.STUCK
            if self._prediction is None:
                self.ids = world.movables.ids
                self._prediction = self._executor.submit(
                    lambda stop: resimulate(scene, self.push, world.robot_pose),
                    world.time,
                )
            if not self._prediction.ready(world.time):
                return Twist(0.0, 0.0)
            if not self._begin(scene, self._prediction.result(), held):
                return ExecutionEnd.FAILED
        if self._stall.update(world.robot_pose, world.time):
            return ExecutionEnd.STUCK
        pushed = self._push(scene, held)
        if isinstance(pushed, Twist):
            self._stall.send(pushed)
            self._speed = pushed.linear
        return pushed

    def abandon(self) -> None:
        """Wait no longer for a prediction that was asked for."""
        if self._prediction is not None:
            self._prediction.abandon()

    def _begin(self, scene: PushScene, ends: list[Push], held: float) -> bool:
        """Take the push as it is predicted from here; whether it is good for anything."""
        push = self.push
        good = [end for end in ends if push.relocates or set(push.delivers) & set(end.delivers)]
        if not good:
            return False
        self.push = max(
            good, key=lambda end: (len(set(end.delivers) & set(push.delivers)), -end.length)
        )
        self.pushing = True
        self._pusher = make_pusher(scene, self.push, held, self._predictive)
        return True

    def _push(self, scene: PushScene, held: float) -> Twist | ExecutionEnd:
        push = self.push
        time = scene.world.time
        left = np.isin(scene.movables.ids, push.delivers) & ~scene.done
        if not push.relocates and not left.any():
            return ExecutionEnd.DONE
        assert self._pusher is not None
        if push.controller == "arc":
            return self._pusher(scene, held) or ExecutionEnd.DONE
        self._driven += (time - self._sent_at) * self._speed
        self._sent_at = time
        self._speed = 0.0
        longest = push.length
        if not push.relocates:
            longest = _LONGER * push.length + _FARTHER * scene.size
        if self._driven > longest - 1e-6:
            return ExecutionEnd.DONE if push.relocates else ExecutionEnd.FAILED
        return self._pusher(scene, held) or ExecutionEnd.FAILED
