"""The recovery behaviour: out of a place from which there is no plan forward."""

from __future__ import annotations

import numpy as np

from pushplan.motion.collision import footprint, is_free, obstacles
from pushplan.world import Drive, Twist, World

_REACH = 0.5
"""How far behind the robot has to be free of walls for it to back up [circumscribed radii]."""


def recovery_twist(world: World) -> Twist | None:
    """A twist that takes a differential drive out of a corner, or None if it has to stay.

    It reverses where there is room behind, else it turns on the spot where its footprint allows.
    Objects are not looked at: backing away from them is what frees a jam.
    """
    robot = world.robot
    if robot.drive is not Drive.DIFFERENTIAL:
        return None
    walls, shape = obstacles(world.static), footprint(robot)
    scratch = np.empty_like(shape.vertices)
    x, y, theta = world.robot_pose
    heading = np.array([np.cos(theta), np.sin(theta)])
    if robot.min_speed < 0.0:
        steps = np.linspace(0.0, _REACH * robot.circumscribed_radius, 6)[1:]
        behind = [np.array([*([x, y] - step * heading), theta]) for step in steps]
        if all(is_free(pose, shape, walls, scratch) for pose in behind):
            return Twist(robot.min_speed, 0.0)
    for side in (1.0, -1.0):
        turned = [np.array([x, y, theta + side * turn]) for turn in np.linspace(0.0, 0.5, 6)[1:]]
        if all(is_free(pose, shape, walls, scratch) for pose in turned):
            return Twist(0.0, side * robot.max_turn_rate)
    return None
