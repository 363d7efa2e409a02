"""The goal of a robot as compiled code reads it."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world import GoalDisc, NavigationGoal
from pushplan.world.checks import FloatArray


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


@kernel
def in_goal(x: float, y: float, goal: FloatArray) -> bool:
    """Tell whether a point [m] counts as the goal, given as `goal_numbers`."""
    if goal[0] == 0.0:
        inside: bool = (x - goal[1]) ** 2 + (y - goal[2]) ** 2 <= goal[3] ** 2
    else:
        inside = (x - goal[1]) * goal[3] + (y - goal[2]) * goal[4] >= 0.0
    return inside


@kernel
def distance_to_goal(x: float, y: float, goal: FloatArray) -> float:
    """Distance [m] from a point to the goal, given as `goal_numbers`; 0 inside."""
    if goal[0] == 0.0:
        gap = np.sqrt((x - goal[1]) ** 2 + (y - goal[2]) ** 2) - goal[3]
    else:
        gap = -((x - goal[1]) * goal[3] + (y - goal[2]) * goal[4])
    left: float = max(gap, 0.0)
    return left
