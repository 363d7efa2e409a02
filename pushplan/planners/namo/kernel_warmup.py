"""Load the compiled kernels of navigation among movable obstacles before they are needed."""

from __future__ import annotations

import functools

import numpy as np

from pushplan.planners.kernel_warmup import warm_up
from pushplan.planners.namo.planner import Namo
from pushplan.world import GoalDisc, MaxIterations, Movables, StaticMap, World, maze_robot

_PUSHES = 30
_BOX = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


@functools.cache
def warm_up_namo() -> None:
    """Do as for the navigator, and open a doorway that a box holds."""
    warm_up("push-aware")
    wall = np.array([[5.8, 0.0], [6.2, 0.0], [6.2, 3.0], [5.8, 3.0]])
    world = World(
        robot=maze_robot("differential"),
        robot_pose=np.array([2.0, 4.0, 0.0]),
        static=StaticMap.build([wall, wall + np.array([0.0, 5.0])], bounds=[0.0, 0.0, 12.0, 8.0]),
        movables=Movables.from_outlines([_BOX], [[6.0, 4.0, 0.0]]),
        goal=GoalDisc(np.array([10.5, 4.0]), 0.5),
    )
    Namo().plan(world, stop=MaxIterations(_PUSHES))
