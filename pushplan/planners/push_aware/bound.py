"""What no plan can cost less than."""

from __future__ import annotations

import numpy as np

from pushplan.geometry import VisibilityGraph
from pushplan.planners.kinodynamic.timing import TIGHTEST
from pushplan.world import Drive, GoalDisc, NavigationGoal, StaticMap, World
from pushplan.world.checks import FloatArray

_TOO_LONG = 7e-4
"""Share by which a `VisibilityGraph` may exceed the shortest path, where that bends around arcs."""
_ANGLES = 720
_PARTS = 12
"""Convex static parts up to which a visibility graph is made."""


def lower_bound(world: World) -> float:
    """A cost that no plan can undercut [kg m].

    Every path is at least as long as the shortest one of the robot's inscribed disc around the
    walls, and as the shortest one under its turn limit without walls; objects only add to that. On
    a map of many parts the former would take too long to know, and counts as nothing.
    """
    goal = world.navigation_goal
    around = 0.0
    if graph_is_quick(world.static):
        graph = VisibilityGraph(world.static, world.robot.inscribed_radius)
        length = float(graph.to_goal(world.robot_pose[:2], goal).length)
        around = length / (1.0 + _TOO_LONG) if np.isfinite(length) else 0.0
    radius = world.robot.turning_radius
    if world.robot.drive is Drive.DIFFERENTIAL:
        radius = 0.0
    radius = max(radius, TIGHTEST * world.robot.circumscribed_radius)
    turning = turning_length(world.robot_pose, goal, radius)
    return world.robot.mass * max(around, turning)


def graph_is_quick(static: StaticMap) -> bool:
    """Whether a visibility graph of this map takes milliseconds: its time grows as corners³."""
    return len(static.convex_parts) <= _PARTS


def turning_length(pose: FloatArray, goal: NavigationGoal, radius: float) -> float:
    """A lower bound [m] on the way from ``pose`` (3,) to a goal under a turn limit, without walls.

    Where the last heading is free, a shortest path is an arc of the sharpest turn, then a straight
    line or a second arc (Dubins 1957); the latter two are no shorter than the straight way from
    where the first ends. The minimum over the angle of the first is taken on a grid, less what it
    can miss.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, _ANGLES + 1)
    least = np.inf
    for side in (1.0, -1.0):
        turned = pose[2] + side * angles
        x = pose[0] + side * radius * (np.sin(turned) - np.sin(pose[2]))
        y = pose[1] - side * radius * (np.cos(turned) - np.cos(pose[2]))
        least = min(least, float((radius * angles + _distances(goal, x, y)).min()))
    return max(least - radius * float(angles[1]), 0.0)


def _distances(goal: NavigationGoal, x: FloatArray, y: FloatArray) -> FloatArray:
    """Distance [m] of points to a goal, 0 inside."""
    if isinstance(goal, GoalDisc):
        gaps = np.hypot(x - goal.center[0], y - goal.center[1]) - goal.radius
    else:
        gaps = -((x - goal.point[0]) * goal.normal[0] + (y - goal.point[1]) * goal.normal[1])
    return np.asarray(np.maximum(gaps, 0.0))
