"""Search for a path on which a robot gets away from where it stands, or out of a tight place."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.time_slicing import never
from pushplan.world import RobotModel, World
from pushplan.world.checks import FloatArray

_STEP = 0.08
"""Length of a step [circumscribed radii], and turn of one on the spot [rad]."""
_CURVATURES = (0.0, 0.5, -0.5, 1.0, -1.0)  # of the arcs [1 / circumscribed radius]


class Room(NamedTuple):
    """Free space of a robot."""

    footprint: core.Footprint
    walls: core.ConvexObstacles
    goal: FloatArray  # (5,) from `goal_numbers`
    spacing: float  # greatest distance between two poses of a path [m]


def gets_away(room: Room, start: FloatArray, size: float, radius: float) -> bool:
    """Tell whether forward arcs lead from a pose (3,) to the goal or three robot sizes away.

    Steps straight ahead, taken up first, and of the least turning radius are tried; objects do not
    count, as they may be pushed.

    Args:
        room: where the robot may go.
        start: (3,) pose of the robot.
        size: its circumscribed radius [m].
        radius: its least turning radius [m].
    """
    return not _is_closed(core.explore_ahead(*room, start, size, radius), never)


def is_boxed_in(
    robot: RobotModel, room: Room, start: FloatArray, radius: float, stopped: Callable[[], bool]
) -> bool:
    """Tell whether nothing that a robot can do gets it from a pose (3,) to the goal or away.

    Args:
        robot: drives ahead and, where it may, back and turns on the spot.
        room: where it may go.
        start: (3,) its pose.
        radius: its least turning radius ahead and back [m].
        stopped: ends the search, after which nothing is known: False.
    """
    size = robot.circumscribed_radius
    search = core.explore_around(
        *room, start, size, radius, robot.min_speed < 0.0, robot.turns_on_spot
    )
    return _is_closed(search, stopped)


def _is_closed(search: core.RoomExploration, stopped: Callable[[], bool]) -> bool:
    """The answer of a search; False where the stop rule ends it before."""
    while not stopped() and not search.run():
        pass
    return search.closed


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
    steps = _STEP * np.array([(size, curvature) for curvature in _CURVATURES])
    if world.robot.min_speed < 0.0:
        steps = np.concatenate([steps, steps * (-1.0, 1.0)])
    steps = np.concatenate([steps, [(0.0, _STEP), (0.0, -_STEP)]])
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
