"""The recovery behaviour: a drive out of a tight place that the robot itself is in."""

from __future__ import annotations

import numpy as np

from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.recovery_kernels import (
    STEP,
    RecoveryProblem,
    can_turn,
    search_recovery,
)
from pushplan.world import World
from pushplan.world.checks import FloatArray


def recovery_path(world: World, margin: float) -> FloatArray | None:
    """A drive (N, 3) that moves no object, to the nearest place with clearance to turn about.

    None if there is no such place within reach, or the robot is in one. What the robot touches at
    first it may touch on the way, but no deeper: a bumper can hook on a corner. The drive keeps
    away from all else if it can.

    Args:
        world: the snapshot.
        margin: distance to keep from what is static if it can [m].
    """
    size = world.robot.circumscribed_radius
    objects = [world.movables.outline_world(k) for k in range(len(world.movables))]
    among, start = obstacles(world.static, objects), np.array(world.robot_pose)
    if can_turn(start, size, among):
        return None
    steps = size * STEP * np.array([(1.0, 0.0), (1.0, 1.0), (1.0, -1.0)])
    steps[:, 1] /= size
    if world.robot.min_speed < 0.0:
        steps = np.concatenate([steps, steps * (-1.0, 1.0)])
    steps = np.concatenate([steps, [(0.0, STEP), (0.0, -STEP)]])
    for distance in (margin, 0.0):
        shape = footprint(world.robot, distance)
        path = search_recovery(RecoveryProblem(start, steps, shape, among, size))
        if len(path):
            return path
    return None
