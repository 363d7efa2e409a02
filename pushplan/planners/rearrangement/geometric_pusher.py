"""`GeometricPusher`: a push along a path as the predictions of pushes assume it."""

from __future__ import annotations

import numpy as np

from pushplan.control import EpisodeClock
from pushplan.control.limits import arc_twist
from pushplan.planners.rearrangement.controller_kernels import PushingController, steer_push
from pushplan.world import Plan, Twist, World
from pushplan.world.checks import expect


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

    def __init__(self, controller: PushingController, shift: float = 0.0) -> None:
        self._controller, self._shift = controller, shift
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
            self._plan, self.along = plan, 0.0
            self._path = np.ascontiguousarray(plan.poses[:, :2])
        found = np.flatnonzero(world.movables.ids == plan.subtasks[0].object_ids[0])
        step, turn = self._controller.step, 0.0
        if len(found):
            step, turn, self.along, _ = steer_push(
                np.array(world.robot_pose),
                np.array(world.movables.poses[found[0]]),
                self._path,
                self.along,
                self._shift,
                self._controller,
            )
        return arc_twist(world.robot, step, turn)
