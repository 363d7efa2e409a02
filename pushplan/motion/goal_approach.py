"""The end of a path at a goal with a heading: a turn on the spot, or a curve into the pose."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.world import GoalPose, RobotModel, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths

_BACK = ((0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0), (6.0, 9.0, 13.0, math.inf))
"""Ways before the end of a path at which a curve may leave it [turning radii]: the first ones, and
those where none of these will do."""
_IN_PLACE = 0.999  # distance from a goal pose at which the robot only turns [its tolerance]
_ROOM = 1.1  # free disc in which a robot turns [circumscribed radii]
_RUN_UP = 12.0  # longest straight way into a goal pose [circumscribed radii]
_STEP = 0.25  # between two lengths of it that are tried [circumscribed radii]


class PathEnd(NamedTuple):
    """The part of a path that takes the place of its last poses."""

    kept: int  # number of poses of the path before it
    poses: FloatArray  # (M, 3)
    curvatures: FloatArray  # (M,) of what leads to each pose [1/m]; infinite on the spot


def turns_at_end(robot: RobotModel) -> bool:
    """Return True if the robot turns to the heading of its goal on the spot, where it has room."""
    return robot.turns_on_spot


def path_end(
    robot: RobotModel,
    goal: GoalPose,
    path: FloatArray,
    radius: float,
    spacing: float,
    checker: core.CollisionChecker,
    straight: float = 0.0,
) -> PathEnd | None:
    """The shortest end of a path at a goal pose that touches nothing static.

    A differential drive goes to the goal and turns on the spot, the shorter way if it can; where
    it has no room for that, and for other drives, a curve of Dubins leads into the pose, or one of
    Reeds and Shepp where a car may reverse.

    Args:
        robot: says how it may turn.
        goal: where the path has to end.
        path: (N, 3) poses that lead to the goal, or near it.
        radius: least turning radius [m].
        spacing: greatest distance between two poses [m].
        checker: of the footprint among what is static.
        straight: length of a straight last piece, from `run_up` [m]; negative for back.

    Returns:
        The end, or None where there is none.
    """
    along = arc_lengths(path)
    begin = behind(goal, straight)
    near = 0.0 if straight else _IN_PLACE * goal.radius
    last = np.array([[straight, 0.0]])
    kinds = [True, False] if turns_at_end(robot) else [False]
    for on_spot, back in product(kinds, _BACK):
        places = np.unique(np.searchsorted(along, along[-1] - radius * np.array(back)))
        back_too = robot.curves_back
        curves = [
            (k, _curve(path[k], begin, radius, on_spot, near, back_too)) for k in places.tolist()
        ]
        curves.sort(key=lambda found: float(along[found[0]] + np.abs(found[1][:, 0]).sum()))
        for k, curve in curves:
            ways = _turned(goal, path[k], curve) if on_spot else iter([curve])
            for pieces in ways:
                poses, curvatures = _laid_out(path[k], np.vstack([pieces, last]), spacing)
                if checker.first_blocked(poses) == len(poses):
                    return PathEnd(k + 1, poses, curvatures)
    return None


def run_up(world: World, goal: GoalPose, radius: float) -> float:
    """The shortest straight way into a goal pose from where the robot has room to turn [m].

    A differential drive has room where it can turn on the spot, another one where a disc is free
    that is larger than the robot by its least turning radius. It is 0 where there is room at the
    goal, or no such way, and negative for one that is driven back, by a robot that may.

    Args:
        world: the scene.
        goal: the pose.
        radius: least turning radius [m].
    """
    robot = world.robot
    size = robot.circumscribed_radius
    walls = obstacles(keep_out(world))
    checker = core.CollisionChecker(footprint(robot), walls)
    room = _ROOM * size
    if not turns_at_end(robot):
        room = radius + size
    ways = [1.0, -1.0] if robot.min_speed < 0.0 else [1.0]
    for steps in range(int(_RUN_UP / _STEP)):
        for way in list(ways):
            length = way * steps * _STEP * size
            pose = behind(goal, length)
            if not checker.is_free(pose):
                ways.remove(way)
            elif walls.can_turn(pose[0], pose[1], room):
                return length
    return 0.0


def behind(goal: GoalPose, length: float) -> FloatArray:
    """(3,) the pose from which a straight way of some length [m] leads into a goal pose."""
    ahead = np.array([math.cos(goal.heading), math.sin(goal.heading)])
    return np.append(goal.center - length * ahead, goal.heading)


def _curve(
    start: FloatArray, end: FloatArray, radius: float, on_spot: bool, near: float, reverses: bool
) -> FloatArray:
    """(E, 2) arcs to a pose, or to its place for a turn: none where that is ``near`` [m]."""
    dx, dy, _ = end - start
    if on_spot:
        if math.hypot(dx, dy) <= near:
            return np.empty((0, 2))
        end = np.array([end[0], end[1], math.atan2(dy, dx)])
    arcs = np.empty((5, 2))
    core.shortest_curve(start, end, radius, reverses, arcs)
    return arcs


def _turned(goal: GoalPose, start: FloatArray, arcs: FloatArray) -> Iterator[FloatArray]:
    """Arcs followed by a turn to the heading of the goal, the shorter way and the longer one."""
    angle = goal.heading_error(float(start[2] + (arcs[:, 0] * arcs[:, 1]).sum()))
    for turn in (angle, angle - math.copysign(math.tau, angle)):
        yield np.vstack([arcs, [abs(turn), math.copysign(math.inf, turn)]])


def _laid_out(
    start: FloatArray, pieces: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Poses (M, 3) along pieces without the start, and the curvatures (M,) that lead to them."""
    steps = [abs(piece) / core.step_along(turn, spacing) for piece, turn in pieces.tolist()]
    poses = np.empty((int(sum(steps)) + len(steps) + 1, 3))
    curvatures = np.empty(len(poses))
    count = core.sample_pieces(start, pieces, spacing, poses, curvatures)
    assert count >= 0
    return poses[:count], curvatures[:count]
