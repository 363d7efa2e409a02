"""`PathPush`: a push of one object along a path, and when it is known to have failed."""

from __future__ import annotations

import numpy as np

from pushplan.control import ProgressChecker
from pushplan.planners.pushing import PushingMpc, PushPath
from pushplan.planners.rearrangement.controller_kernels import is_on_bumper
from pushplan.planners.rearrangement.geometric_pusher import GeometricPusher
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.world import Twist

_TURN_PATIENCE = 0.15  # turn in the time of which an object has to get on [rad]


class PathPush:
    """Pushes an object along a path while it stays on the bumper and gets on.

    Args:
        scene: as the push begins.
        target: id of the object.
        path: of its middle.
        pusher: chooses the velocities.
    """

    def __init__(
        self, scene: PushScene, target: int, path: PushPath, pusher: GeometricPusher | PushingMpc
    ) -> None:
        robot, config = scene.world.robot, scene.config
        self._plan, self._pusher = path.plan(robot, target), pusher
        patience = max(scene.size / robot.max_speed, _TURN_PATIENCE / robot.max_turn_rate)
        self._progress = ProgressChecker(config.progress * scene.size, patience)

    def command(self, scene: PushScene) -> Twist | None:
        """The velocity to drive now; None where the object has been lost or does not get on.

        It goes on with an object that is done, for what rides along.
        """
        world = scene.world
        twist = self._pusher.command(world, self._plan)
        target = self._plan.subtasks[0].object_ids[0]
        remaining = self._plan.length - self._pusher.along
        for k in np.flatnonzero((world.movables.ids == target) & ~scene.done):
            holds = is_on_bumper(np.array(world.robot_pose), scene.poses[k], scene.controller)
            if not (holds and self._progress.update(remaining, world.time)):
                return None
        return twist
