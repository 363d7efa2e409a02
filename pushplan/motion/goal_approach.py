"""The end of a path at a goal with a heading: a turn on the spot, or a curve into the pose."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.world import GoalPose, RobotModel, World
from pushplan.world.checks import FloatArray

_MOST_BOXES = 500  # boxes of poses that are checked at most
_WITHIN = 0.9  # part of the tolerances that is used


class PathEnd(NamedTuple):
    """The part of a path that takes the place of its last poses."""

    kept: int  # number of poses of the path before it
    poses: FloatArray  # (M, 3)
    curvatures: FloatArray  # (M,) of what leads to each pose [1/m]; infinite on the spot


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
    turns = core.EndTurns(robot.turns_on_spot, robot.curves_back, radius, spacing)
    poses = np.ascontiguousarray(path)
    end = PathEnd(*core.path_end(_numbers(goal), poses, turns, straight, checker))
    return end if end.kept else None


def fitting(world: World, goal: GoalPose) -> GoalPose | None:
    """The goal, or where the robot does not fit in its middle, tolerances around where it does.

    Boxes of poses are halved, beginning with that of all tolerances, until the robot fits in the
    middle of one. A box is left out if what is left of the footprint after every motion within it
    touches something static in the middle.

    Returns:
        None if the robot fits nowhere in the goal; the goal itself where that is not known.
    """
    robot = world.robot
    static = keep_out(world)
    walls = obstacles(static)
    checker = core.CollisionChecker(footprint(robot), walls)
    boxes = deque([(np.zeros(3), goal.radius, goal.heading_tolerance)])
    for _ in range(_MOST_BOXES):
        if not boxes:
            return None
        off, half, turn = boxes.popleft()
        pose = goal.pose + off
        away = float(np.hypot(off[0], off[1]))
        aside = abs(float(off[2]))
        within = max(away / goal.radius, aside / goal.heading_tolerance)
        if within <= _WITHIN and checker.is_free(pose):
            left = goal.radius - away, pose[2], goal.heading_tolerance - aside
            return GoalPose(pose[:2], *left) if within else goal
        reach = math.sqrt(2.0) * half
        inside = np.append(np.clip(pose[:2], static.bounds[:2], static.bounds[2:]), pose[2])
        if max(math.dist(inside, pose), away - goal.radius) > reach:
            continue
        least = footprint(robot, -reach - robot.circumscribed_radius * turn)
        if not core.CollisionChecker(least, walls).is_free(inside):
            continue
        if reach > robot.circumscribed_radius * turn:
            half = 0.5 * half
            steps = [(x, y, 0.0) for x in (-half, half) for y in (-half, half)]
        else:
            turn = 0.5 * turn
            steps = [(0.0, 0.0, -turn), (0.0, 0.0, turn)]
        boxes.extend((off + np.array(step), half, turn) for step in steps)
    return goal


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
    checker = core.CollisionChecker(footprint(robot), obstacles(keep_out(world)))
    turns = core.EndTurns(robot.turns_on_spot, robot.min_speed < 0.0, radius, 0.0)
    return core.run_up(_numbers(goal), turns, robot.circumscribed_radius, checker)


def behind(goal: GoalPose, length: float) -> FloatArray:
    """(3,) the pose from which a straight way of some length [m] leads into a goal pose."""
    ahead = np.array([math.cos(goal.heading), math.sin(goal.heading)])
    return np.append(goal.center - length * ahead, goal.heading)


def _numbers(goal: GoalPose) -> FloatArray:
    return np.array([2.0, *goal.center, goal.radius, goal.heading])
