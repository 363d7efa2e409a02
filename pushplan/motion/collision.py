"""Footprint, obstacles and goal of a robot, as the collision checks of the core read them."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from pushplan.core import motion as core
from pushplan.world import GoalDisc, NavigationGoal, RobotModel, StaticMap
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten
from pushplan.world.static_map import core_map


@functools.lru_cache(maxsize=64)
def footprint(robot: RobotModel, margin: float = 0.0) -> core.Footprint:
    """Return the robot's parts that count at walls, grown by ``margin`` [m], sharp corners cut."""
    return core.Footprint(core.OwnFootprint(*flatten(robot.wall_parts), margin))


def obstacles(
    static: StaticMap, outlines: Sequence[FloatArray] = (), bounds: FloatArray | None = None
) -> core.ConvexObstacles:
    """Everything static, and further convex outlines in the world frame.

    Args:
        static: the map.
        outlines: of what else is in the way, each (N, 2) [m].
        bounds: (4,) other bounds of the workspace [m]; a pose outside is not free.
    """
    if not outlines and bounds is None:
        return core.ConvexObstacles(core_map(static))
    within = static.bounds if bounds is None else bounds
    return core.MoreObstacles(core_map(static), *flatten(outlines), within)


def goal_numbers(goal: NavigationGoal, inset: float) -> FloatArray:
    """A goal as numbers, entered by ``inset`` [m] so that noise does not miss it.

    Returns:
        (5,) 0, x, y, radius, 0 for a disc; 1, x, y, n_x, n_y for a line.
    """
    if isinstance(goal, GoalDisc):
        radius = max(goal.radius - inset, 0.5 * goal.radius)
        return np.array([0.0, goal.center[0], goal.center[1], radius, 0.0])
    point = goal.point + inset * goal.normal
    return np.array([1.0, point[0], point[1], goal.normal[0], goal.normal[1]])
