"""`PushExecution`: one push in hand: drive there, look again, push, and know when it ends."""

from __future__ import annotations

import enum
import math

import numpy as np

from pushplan.control import LegFollower, PoseFollower, StallChecker
from pushplan.control.limits import arc_twist
from pushplan.planners.pushing import PushingConfig, PushingMpc, PushParameters, PushPath
from pushplan.planners.rearrangement.geometric_pusher import GeometricPusher
from pushplan.planners.rearrangement.path_push import PathPush
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_poses import initial_heading
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.route import Route
from pushplan.world import PendingResult, PlanningExecutor, Twist, World
from pushplan.world.checks import FloatArray

_ALIGNED = math.radians(0.4)  # error of a heading that is left where a push begins
_MPC_HEADING = math.radians(20.0)
"""A push that begins farther off the object's path is left to the geometric controller."""
_NEAR = 0.004  # the same of the place [circumscribed radii]


class ExecutionEnd(enum.Enum):
    """How an execution ended."""

    DONE = "done"
    """What it was for is where it belongs, or has been relocated."""
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
        config: settings.
        executor: runs the prediction of the push from where the route has led to.
        predictive: whether to push by predictive control where that suits.

    Attributes:
        push: the push, as predicted last.
        route: to its start.
        pushing: whether the push itself has begun.
        ids: (K,) of the objects that the prediction of the push is about.
        asked_for_next: whether what comes after it has been asked for.
    """

    def __init__(
        self,
        world: World,
        push: Push,
        route: Route,
        config: RearrangementConfig,
        executor: PlanningExecutor,
        *,
        predictive: bool = True,
    ) -> None:
        self.push, self.route, self.pushing = push, route, False
        self.ids, self.asked_for_next = world.movables.ids, False
        self._executor, self._predictive = executor, predictive
        self._prediction: PendingResult[list[Push]] | None = None
        self._route_follower = LegFollower(
            world.robot,
            route,
            near=_NEAR * world.robot.circumscribed_radius + config.position_noise,
            aligned=_ALIGNED + config.heading_noise,
            response=config.response,
        )
        self._path_push: PathPush | None = None
        self._pose_follower: PoseFollower | None = None
        self._stall = StallChecker(world.robot)
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
            if self._is_obsolete(scene):
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
                    lambda stop: PushSimulator(scene).resimulate(self.push, world.robot_pose),
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

    def _is_obsolete(self, scene: PushScene) -> bool:
        """Whether the object to be pushed has gone, or is where it belongs already."""
        target = np.flatnonzero(scene.world.movables.ids == self.push.target)
        return not len(target) or bool(scene.done[target[0]])

    def _begin(self, scene: PushScene, ends: list[Push], held: float) -> bool:
        """Take the push as it is predicted from here; whether it is good for anything."""
        push, world = self.push, scene.world
        good = [end for end in ends if push.relocates or set(push.delivers) & set(end.delivers)]
        if not good:
            return False
        self.push = max(
            good, key=lambda end: (len(set(end.delivers) & set(push.delivers)), -end.length)
        )
        self.pushing = True
        if self.push.controller == "arc":
            self._pose_follower = PoseFollower(world.robot, self.push.poses, scene.config.response)
        if self.push.controller == "path":
            self._path_push = self._choose_pusher(scene, held)
        return True

    def _choose_pusher(self, scene: PushScene, held: float) -> PathPush:
        """Predictive control where that suits, else the controller of the prediction."""
        push, config = self.push, scene.config
        if self._predictive and suits_mpc(scene, push):
            path = PushPath.through(push.object_path, radius=scene.size)
            parameters = PushParameters(config.friction)
            mpc = PushingMpc(PushingConfig(parameters=parameters, period=held))
            return PathPush(scene, push.target, path, mpc)
        controller = scene.controller._replace(gain=push.gain)
        path = PushPath.through(push.object_path)
        return PathPush(scene, push.target, path, GeometricPusher(controller, push.shift))

    def _push(self, scene: PushScene, held: float) -> Twist | ExecutionEnd:
        push, world, pose = self.push, scene.world, scene.world.robot_pose
        ids = world.movables.ids
        left = np.isin(ids, push.delivers) & ~scene.done
        if not push.relocates and not left.any():
            return ExecutionEnd.DONE
        if self._pose_follower is not None:
            return self._pose_follower.command(pose, world.time, held) or ExecutionEnd.DONE
        self._driven += (world.time - self._sent_at) * self._speed
        self._sent_at, self._speed = world.time, 0.0
        longest = push.length if push.relocates else 1.1 * push.length + 0.4 * scene.size
        if self._driven > longest - 1e-6:
            return ExecutionEnd.DONE if push.relocates else ExecutionEnd.FAILED
        if self._path_push is not None:
            return self._path_push.command(scene) or ExecutionEnd.FAILED
        turn = _line_turn(push.start, pose, scene.size)
        return arc_twist(world.robot, scene.controller.step, turn)


def suits_mpc(scene: PushScene, push: Push) -> bool:
    """Whether the contact model of `PushingMpc` describes a push: of one object, along its path."""
    if push.relocates or push.delivers != (push.target,):
        return False
    away = initial_heading(push.object_path, 0.5 * scene.size) - float(scene.world.robot_pose[2])
    return abs(math.remainder(away, math.tau)) < _MPC_HEADING


def _line_turn(start: FloatArray, pose: FloatArray, size: float) -> float:
    """The turn [rad] that keeps the robot on the line of a push."""
    error = math.remainder(float(start[2] - pose[2]), 2.0 * math.pi)
    away = pose[:2] - start[:2]
    left = float(math.cos(start[2]) * away[1] - math.sin(start[2]) * away[0])
    return 0.5 * error - 0.3 * left / size
