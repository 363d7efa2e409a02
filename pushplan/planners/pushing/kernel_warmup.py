"""Load the compiled kernels of pushing before the first command that is timed."""

from __future__ import annotations

import numpy as np

from pushplan.planners.pushing.mpc import PushingMpc
from pushplan.planners.pushing.path import PushPath
from pushplan.world import Movables, Receptacle, StaticMap, World, area_clearing_robot


def warm_up() -> None:
    """Push a box for three steps.

    Numba compiles a kernel on its first use after an installation (seconds) and loads it from its
    cache on the first use in a process. A controller calls this once when it starts.
    """
    square = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    world = World(
        robot=area_clearing_robot(),
        robot_pose=np.array([-1.25, 0.0, 0.0]),
        static=StaticMap.build(polygons=[square + 8.0], bounds=[-10.0, -10.0, 10.0, 10.0]),
        movables=Movables.from_outlines([square], [[0.0, 0.0, 0.2]]),
        goal=Receptacle(square + 5.0),
    )
    plan = PushPath.arcs([0.0, 0.0, 0.0], [(1.0, 0.0), (1.0, 0.2)]).plan(world.robot, 0)
    mpc = PushingMpc()
    for i in range(3):
        pose = [-1.25 + 0.02 * i, 0.0, 0.0]
        mpc.command(world.moved(robot_pose=pose, time=0.1 * i), plan)
