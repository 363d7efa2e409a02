"""`PushExecution`: one push in hand: drive there, look again, push, and know when it ends."""

from __future__ import annotations

import enum
import math

import numpy as np

from pushplan.control import LegFollower, StallChecker
from pushplan.planners.rearrangement.approach import Route
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_controllers import Pusher, make_pusher
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import resimulate
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import PendingResult, PlanningExecutor, RobotModel, Twist
from pushplan.world.checks import IntArray

_ALIGNED = math.radians(0.4)  # error of a heading that is left where a push begins
_PLACED = 0.004  # error of the place that is left where a push begins [circumscribed radii]
_LONGER = 1.1
_FARTHER = 0.4
"""A push home has failed that is longer than predicted by this factor and by this distance
[circumscribed radii]."""


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
