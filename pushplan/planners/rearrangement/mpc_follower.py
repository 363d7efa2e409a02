"""`MpcFollower`: a push of one object along its path by predictive control."""

from __future__ import annotations

import math

from pushplan.planners.pushing import PushingConfig, PushingMpc, PushParameters, PushPath
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_poses import initial_heading
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.world import Twist, World

_ALIGNED = math.radians(20.0)
"""A push that begins farther off the object's path is left to the geometric controller."""
_BLOCKED = 0.2  # fraction of a command that is driven, below which the push does not get on
_PATIENCE = 0.8  # time for which it may be so [s]


def suits_mpc(scene: PushScene, push: Push) -> bool:
    """Whether the contact model of `PushingMpc` describes a push: of one object, along its path."""
    if not push.follows_path or push.pre_relocates or push.delivers != (push.target,):
        return False
    away = initial_heading(push.object_path, 0.5 * scene.size) - float(scene.world.robot_pose[2])
    return abs(math.remainder(away, math.tau)) < _ALIGNED


class MpcFollower:
    """Drives one push by `PushingMpc`.

    Args:
        scene: in which the push begins.
        push: a push that `suits_mpc`.
        held: for how long the first command will be held [s].
    """

    def __init__(self, scene: PushScene, push: Push, held: float) -> None:
        config = PushingConfig(parameters=PushParameters(scene.config.friction), period=held)
        self._mpc = PushingMpc(config)
        robot = scene.world.robot
        self._plan = PushPath.through(push.object_path, radius=scene.size).plan(robot, push.target)
        self._going_since = scene.world.time

    def command(self, world: World) -> Twist | None:
        """The velocity to drive now; None where something static is in the way for good."""
        twist = self._mpc.command(world, self._plan)
        if self._mpc.slowed >= _BLOCKED:
            self._going_since = world.time
        return None if world.time - self._going_since > _PATIENCE else twist
