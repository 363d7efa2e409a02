"""Search for a path on which a robot gets away from where it stands, or out of a tight place."""

from __future__ import annotations

import math
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
_CELL = 0.6  # sides of the boxes of poses of which one is looked at each [steps]
_LEAST_TURN = 0.02  # the same of headings at least [rad]
_REACH = 3.0  # distance at which the robot has got away [circumscribed radii]
_FAR = 12.0  # the same where it looks for a place to turn about [circumscribed radii]
_SPACIOUS = 1.3  # clearance that it turns about with at best: curves lead on from there [R]
_MOST_POSES_AHEAD = 5_000  # poses that are looked at, ahead; then it counts as getting away
_MOST_POSES = 60_000  # the same where the robot may do all that it can
_PIECE = 250  # poses between two looks at the stop rule: about a millisecond
_FINER = 0.25  # steps of the second look, before a robot is said to be boxed in
_CURVATURES = (0.0, 0.5, -0.5, 1.0, -1.0)  # of the arcs [1 / circumscribed radius]


class Room(NamedTuple):
    """Free space of a robot."""

    footprint: core.Footprint
    walls: core.ConvexObstacles
    goal: FloatArray  # (5,) from `goal_numbers`
    spacing: float  # greatest distance between two poses of a path [m]


class _Rules(NamedTuple):
    """Moves that an exploration tries, and conditions that end it."""

    moves: FloatArray  # (M, 2) arcs to try from each pose
    reach: float  # distance at which the robot has got away [m]
    clearance: float  # of places to turn about that are looked for, 0 for none [m]
    breadth: bool  # fewest moves first; else the last move from the last pose


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
    rules = _Rules(_arcs(_STEP * size, radius), _REACH * size, 0.0, False)
    return _search(room, rules, start, _MOST_POSES_AHEAD, never)[0] != core.RoomOutcome.CLOSED


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
    for step in (_STEP, _FINER * _STEP):
        moves = _moves(robot, step, radius)
        rules = _Rules(moves, _REACH * size, 0.0, False)
        if _search(room, rules, start, _MOST_POSES, stopped)[0] != core.RoomOutcome.CLOSED:
            return False
    return True


def way_to_turn(
    robot: RobotModel, room: Room, start: FloatArray, stopped: Callable[[], bool]
) -> FloatArray | None:
    """The drive with the fewest steps to where a differential drive can turn about, or far away.

    Args:
        robot: the robot.
        room: where it may go.
        start: (3,) its pose.
        stopped: ends the search.

    Returns:
        (E, 2) arcs; None where there is no such drive, or the robot can turn about where it is.
    """
    size = robot.circumscribed_radius
    swept = room.footprint.radius
    if room.walls.can_turn(start[0], start[1], swept):
        return None
    moves = _moves(robot, _STEP, size)
    for clearance, most in ((_SPACIOUS * swept, _MOST_POSES_AHEAD), (swept, _MOST_POSES)):
        rules = _Rules(moves, _FAR * size, clearance, True)
        outcome, search = _search(room, rules, start, most, stopped)
        if outcome == core.RoomOutcome.AWAY:
            return search.arcs
    return None


def _arcs(step: float, radius: float) -> FloatArray:
    """(3, 2) arcs of a length [m] ahead."""
    return np.array([(step, side / radius) for side in (-1.0, 1.0, 0.0)])


def _moves(robot: RobotModel, step: float, radius: float) -> FloatArray:
    """(M, 2) all that a robot can do; steps are in circumscribed radii, or turns [rad]."""
    moves = _arcs(step * robot.circumscribed_radius, radius)
    if robot.min_speed < 0.0:
        moves = np.concatenate([moves * (-1.0, 1.0), moves])
    if robot.turns_on_spot:
        moves = np.concatenate([[(step, -math.inf), (step, math.inf)], moves])
    return moves


def _search(
    room: Room,
    rules: _Rules,
    start: FloatArray,
    most: int,  # poses to look at
    stopped: Callable[[], bool],
) -> tuple[core.RoomOutcome, core.RoomExploration]:
    """Explore from ``start`` until the outcome is known, or as long as is allowed."""
    moves = np.abs(rules.moves).tolist()
    cell = _CELL * moves[-1][0]
    turns = [
        length if math.isinf(curvature) else length * curvature
        for length, curvature in moves
        if curvature
    ]
    turn = min(max(_CELL * min(turns), _LEAST_TURN), math.pi)
    half = int(rules.reach / cell) + 2
    headings = math.ceil(math.tau / turn)
    capacity = len(rules.moves) * most + 1
    search = core.RoomExploration(
        *room, *rules, start, side=cell, turn=turn, half=half, headings=headings, capacity=capacity
    )
    outcome = core.RoomOutcome.PAUSED
    for upto in range(_PIECE, most + _PIECE, _PIECE):
        if outcome != core.RoomOutcome.PAUSED or stopped():
            break
        outcome = search.run(min(upto, most))
    return outcome, search


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
