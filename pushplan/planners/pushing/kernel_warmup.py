"""Load the compiled kernels of pushing before the first command that is timed."""

from __future__ import annotations

import numpy as np

from pushplan.planners.pushing.executor import PushExecutor, PushTask
from pushplan.planners.pushing.mpc import PushingMpc
from pushplan.planners.pushing.path import PushPath
from pushplan.world import Movables, Receptacle, StaticMap, World, area_clearing_robot


def warm_up(executor: bool = True) -> None:
    """Get behind a box and push it once.

    Numba compiles a kernel on its first use after an installation (seconds) and loads it from its
    cache on the first use in a process. A controller calls this once when it starts.

    Args:
        executor: whether also what `PushExecutor` needs beside `PushingMpc`.
    """
    square = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    world = World(
        robot=area_clearing_robot(),
        robot_pose=np.array([-6.0, 0.0, 0.0]),
        static=StaticMap.build(polygons=[square + 8.0], bounds=[-10.0, -10.0, 10.0, 10.0]),
        movables=Movables.from_outlines([square, square], [[0.0, 0.0, 0.2], [-2.0, 4.0, 0.0]]),
        goal=Receptacle(square + 5.0),
    )
    path = PushPath.arcs([0.0, 0.0, 0.0], [(1.0, 0.0), (1.0, 0.2)])
    pushes, mpc = PushExecutor(), PushingMpc()
    task, plan = PushTask(0, path), path.plan(world.robot, 0)
    for i in range(3):
        if executor:
            pushes.command(world.moved(time=0.1 * i), task)
        pose = [-1.25 + 0.02 * i, 0.0, 0.0]
        mpc.command(world.moved(robot_pose=pose, time=0.1 * i), plan)
