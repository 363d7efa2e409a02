"""Search for a path on which a robot gets away from where it stands, or out of a tight place."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free
from pushplan.motion.dubins import along_arc, step_along
from pushplan.motion.goal_region import in_goal
from pushplan.motion.recovery_path import can_turn
from pushplan.motion.time_slicing import never
from pushplan.world import Drive, RobotModel
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_STEP = 0.08  # length of a step [circumscribed radii]
_CELL = 0.6  # sides of the boxes of poses of which one is looked at each [steps]
_LEAST_TURN = 0.02  # the same of headings at least [rad]
_REACH = 3.0  # distance at which the robot has got away [circumscribed radii]
_FAR = 12.0  # the same where it looks for a place to turn about [circumscribed radii]
_SPACIOUS = 1.3  # clearance that it turns about with at best: curves lead on from there [R]
_MOST_POSES_AHEAD = 5_000  # poses that are looked at, ahead; then it counts as getting away
_MOST_POSES = 60_000  # the same where the robot may do all that it can
_PIECE = 250  # poses between two looks at the stop rule: about a millisecond
_FINER = 0.25  # steps of the second look, before a robot is said to be boxed in
_CLOSED = -1
_PAUSED = -2


class Room(NamedTuple):
    """Free space of a robot."""

    footprint: Footprint
    walls: ConvexObstacles
    goal: FloatArray  # (5,) from `goal_numbers`
    spacing: float  # greatest distance between two poses of a path [m]


class _Rules(NamedTuple):
    """Moves that an exploration tries, and conditions that end it."""

    moves: FloatArray  # (M, 2) arcs to try from each pose
    reach: float  # distance at which the robot has got away [m]
    clearance: float  # of places to turn about that are looked for, 0 for none [m]
    breadth: bool  # fewest moves first; else the last move from the last pose


class _Explored(NamedTuple):
    """Poses that were found, in memory that is made once."""

    poses: FloatArray  # (N, 3)
    before: IntArray  # (N,) the pose before each one
    moves: IntArray  # (N,) the move that has led to it
    open: IntArray  # (N,) poses to go on from
    counters: IntArray  # (4,) first and last + 1 of the open ones, poses found, poses looked at
    seen: BoolArray  # (rows, columns, headings) boxes with a pose


@kernel(allocates=True)
def _explore(
    room: Room,
    rules: _Rules,
    sides: FloatArray,  # (2,) of the boxes of poses of which one is looked at each [m, rad]
    found: _Explored,  # changed in place
    upto: int,  # poses looked at in all
) -> int:
    """Go on until so many poses are looked at; the pose that is away, `_CLOSED` or `_PAUSED`.

    Objects do not count, as they may be pushed.
    """
    poses = found.poses
    counters = found.counters
    start = found.poses[0]
    half = found.seen.shape[0] // 2
    turns = found.seen.shape[2]
    corners = np.empty_like(room.footprint.vertices)
    pose = np.empty(3)
    while counters[0] < counters[1] and counters[3] < upto:
        counters[3] += 1
        if rules.breadth:
            at = found.open[counters[0]]
            counters[0] += 1
        else:
            counters[1] -= 1
            at = found.open[counters[1]]
        for m in range(rules.moves.shape[0]):
            length = rules.moves[m, 0]
            curvature = rules.moves[m, 1]
            steps = 1
            free = True
            if rules.breadth:  # the way may be driven: these are the poses that its plan will have
                steps = int(np.ceil(abs(length) / step_along(curvature, room.spacing)))
            for step in range(1, steps + 1):
                along_arc(poses[at], length * step / steps, curvature, pose)
                free = free and is_free(pose, room.footprint, room.walls, corners)
            if not free:
                continue
            dx = pose[0] - start[0]
            dy = pose[1] - start[1]
            j = half + int(np.rint(dx / sides[0]))
            i = half + int(np.rint(dy / sides[0]))
            t = int(np.floor(pose[2] % (2.0 * np.pi) / sides[1])) % turns
            new = counters[2]
            if new == poses.shape[0] or found.seen[i, j, t]:
                continue
            found.seen[i, j, t] = True
            copy_into(poses[new], pose)
            found.before[new] = at
            found.moves[new] = m
            counters[2] += 1
            away = dx * dx + dy * dy > rules.reach * rules.reach
            if rules.clearance > 0.0:
                away = away or can_turn(pose, rules.clearance, room.walls)
            if away or in_goal(pose[0], pose[1], room.goal):
                return int(new)
            found.open[counters[1]] = new
            counters[1] += 1
    return _PAUSED if counters[0] < counters[1] else _CLOSED


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
    return _search(room, rules, start, _MOST_POSES_AHEAD, never)[0] != _CLOSED


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
        if _search(room, rules, start, _MOST_POSES, stopped)[0] != _CLOSED:
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
    if can_turn(start, swept, room.walls):
        return None
    moves = _moves(robot, _STEP, size)
    for clearance, most in ((_SPACIOUS * swept, _MOST_POSES_AHEAD), (swept, _MOST_POSES)):
        rules = _Rules(moves, _FAR * size, clearance, True)
        at, found = _search(room, rules, start, most, stopped)
        if at > 0:
            break
    arcs = []
    while at > 0:
        arcs.append(moves[found.moves[at]])
        at = int(found.before[at])
    return np.array(arcs[::-1]) if arcs else None


def _arcs(step: float, radius: float) -> FloatArray:
    """(3, 2) arcs of a length [m] ahead."""
    return np.array([(step, side / radius) for side in (-1.0, 1.0, 0.0)])


def _moves(robot: RobotModel, step: float, radius: float) -> FloatArray:
    """(M, 2) all that a robot can do; steps are in circumscribed radii, or turns [rad]."""
    moves = _arcs(step * robot.circumscribed_radius, radius)
    if robot.min_speed < 0.0:
        moves = np.concatenate([moves * (-1.0, 1.0), moves])
    if robot.drive is Drive.DIFFERENTIAL:
        moves = np.concatenate([[(step, -math.inf), (step, math.inf)], moves])
    return moves


def _search(
    room: Room,
    rules: _Rules,
    start: FloatArray,
    most: int,  # poses to look at
    stopped: Callable[[], bool],
) -> tuple[int, _Explored]:
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
    found = _Explored(
        poses=np.empty((capacity, 3)),
        before=np.zeros(capacity, dtype=np.int64),
        moves=np.zeros(capacity, dtype=np.int64),
        open=np.zeros(capacity, dtype=np.int64),
        counters=np.array([0, 1, 1, 0]),
        seen=np.zeros((2 * half + 1, 2 * half + 1, headings), dtype=np.bool_),
    )
    found.poses[0] = start
    outcome = _PAUSED
    sides = np.array([cell, turn])
    for upto in range(_PIECE, most + _PIECE, _PIECE):
        if outcome != _PAUSED or stopped():
            break
        outcome = int(_explore(room, rules, sides, found, min(upto, most)))
    return outcome, found
