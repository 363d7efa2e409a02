"""Lower bound on the cost of every plan, from shortest paths and the turn limit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.geometry import VisibilityGraph
from pushplan.geometry.contours import COARSE, has_many_corners
from pushplan.geometry.obstacles import obstacles_of
from pushplan.geometry.shortest_path import leave_inflation
from pushplan.geometry.visibility_graph import SOME_CORNERS
from pushplan.motion.keep_out import keep_out
from pushplan.motion.speed_profile import TIGHTEST
from pushplan.world import Drive, GoalDisc, NavigationGoal, StaticMap, World
from pushplan.world.checks import FloatArray

_TOO_LONG = 7e-4
"""Fraction by which an exact `VisibilityGraph` may exceed the shortest path around arcs."""
SLIM = 1e-3
"""Fraction by which the disc is less than the inscribed one: gaps as wide as the robot count."""
_DIRECTIONS = 360


def too_long(static: StaticMap) -> float:
    """Fraction by which exact shortest paths on a map may come out too long."""
    if has_many_corners(obstacles_of(static)):
        return _TOO_LONG * COARSE**2
    return _TOO_LONG


def length_bound(world: World, stopped: Callable[[], bool] = lambda: False) -> float:
    """A cost that no plan can undercut [kg m].

    Every path is at least as long as the shortest one of the robot's inscribed disc around the
    walls, and as the shortest one under its turn limit without walls; objects only add to that.
    The former counts as nothing where the robot starts too near to a wall, obstacles have more than
    400 corners, or the stop rule fires.
    """
    goal = world.navigation_goal
    around = 0.0
    clearance = (1.0 - SLIM) * world.robot.inscribed_radius
    start = world.robot_pose[:2]
    static = keep_out(world)
    few = len(obstacles_of(static, clearance).vertices) <= SOME_CORNERS
    if few and not stopped() and is_clear(static, start, clearance):
        graph = VisibilityGraph(static, clearance, exact=True)
        length = float(graph.to_goal(start, goal, stopped).length)
        if np.isfinite(length):
            around = length / (1.0 + too_long(static))
    robot = world.robot
    if robot.drive is Drive.CONSTANT_SPEED or (robot.drive is Drive.CAR and not robot.min_speed):
        radius = max(robot.turning_radius, TIGHTEST * robot.circumscribed_radius)
        turning = turning_length(world.robot_pose, goal, radius)
    else:  # it may turn on the spot, or go back, at first
        turning = goal.distance(*world.robot_pose[:2])
    return robot.mass * max(around, turning)


def is_clear(static: StaticMap, point: FloatArray, clearance: float) -> bool:
    """Return True if a disc at a point (2,) is off all walls; else its path first leaves them."""
    place = leave_inflation(static, clearance, point)
    return place is not None and bool(np.array_equal(place, point))


def turning_length(pose: FloatArray, goal: NavigationGoal, radius: float) -> float:
    """A lower bound [m] on the way from ``pose`` (3,) to a goal under a turn limit, without walls.

    On the shortest way to a line the robot turns towards its normal and goes on straight. A disc
    lies behind the tangent on its near side in every direction; the greatest of these bounds is
    taken.
    """
    if isinstance(goal, GoalDisc):
        towards = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
        normals = np.column_stack([np.cos(towards), np.sin(towards)])
        away = normals @ (goal.center - pose[:2]) - goal.radius
    else:
        normals = goal.normal[None]
        away = normals @ (goal.point - pose[:2])
    normals = normals[away > 0.0]
    away = away[away > 0.0]
    if len(away) == 0:
        return 0.0
    turn = np.abs(np.angle(np.exp(1j * (np.arctan2(normals[:, 1], normals[:, 0]) - pose[2]))))
    gained = radius * np.sin(turn)  # towards the line, by the time that it is faced
    within = np.arcsin(np.clip(np.sin(turn) - away / radius, -1.0, 1.0))
    ways = np.where(away >= gained, radius * turn + away - gained, radius * (turn - within))
    return float(ways.max())
