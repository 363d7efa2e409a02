"""The recovery behaviour: a drive out of a tight place that the robot itself is in."""

from __future__ import annotations

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.world import World
from pushplan.world.checks import FloatArray

STEP = 0.08
"""Length of a step [circumscribed radii], and turn of one on the spot [rad]."""
_CURVATURES = (0.0, 0.5, -0.5, 1.0, -1.0)  # of the arcs [1 / circumscribed radius]


def recovery_path(world: World, margin: float) -> FloatArray | None:
    """A drive (N, 3) to the nearest place with clearance to turn about.

    It moves no object if it can; where objects close the way out, it pushes them along. None if
    there is no such place within reach, or the robot is in one. What the robot touches at first it
    may touch on the way, but no deeper: a bumper can hook on a corner. The drive keeps away from
    all else if it can.

    Args:
        world: the snapshot.
        margin: distance to keep from what is static if it can [m].
    """
    size = world.robot.circumscribed_radius
    movables = world.movables
    objects = [part for k in range(len(movables)) for part in movables.parts_world(k)]
    start = world.robot_pose
    walls = obstacles(world.static)
    steps = STEP * np.array([(size, curvature) for curvature in _CURVATURES])
    if world.robot.min_speed < 0.0:
        steps = np.concatenate([steps, steps * (-1.0, 1.0)])
    steps = np.concatenate([steps, [(0.0, STEP), (0.0, -STEP)]])
    body = footprint(world.robot)
    surroundings = [walls]
    if objects:  # it pushes them only where there is no way between them
        surroundings.insert(0, obstacles(world.static, objects))
    for among in surroundings:
        if among.can_turn(start[0], start[1], size):
            return None
        for distance in dict.fromkeys((margin, 0.0)):
            grown = footprint(world.robot, distance)
            path = core.recovery_path(start, steps, body, grown, among, size)
            if len(path):
                return path
    return None
