"""The goal of a robot as the core reads it."""

from __future__ import annotations

import numpy as np

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
