"""Load the compiled kernels of the manipulation policies before they are needed."""

from __future__ import annotations

import numpy as np

from pushplan.planners.pushing import warm_up as warm_up_pushing
from pushplan.planners.subtasks.freeing import freeing_pushes
from pushplan.planners.subtasks.leaving import way_out
from pushplan.planners.subtasks.maneuvers import maneuvers
from pushplan.planners.subtasks.policy import GtspMpc
from pushplan.planners.subtasks.runner import Runner
from pushplan.planners.subtasks.scene import Scene
from pushplan.world import (
    ClearanceArea,
    Movables,
    Receptacle,
    StaticMap,
    World,
    box_delivery_robot,
)


def warm_up_subtasks() -> None:
    """Plan once for a box in each kind of task, so that the first step of an episode is quick."""
    warm_up_pushing()
    square = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
    for goal in (
        ClearanceArea(3.0 * square, np.array([True, False, False, False])),
        Receptacle(square + 2.5),
    ):
        world = World(
            robot=box_delivery_robot(),
            robot_pose=np.array([-2.2, -2.0, 0.0]),
            static=StaticMap.build(polygons=[0.2 * square - 2.9], bounds=(-3.0, -3.0, 3.0, 3.0)),
            movables=Movables.from_outlines([0.44 * square], [(0.2, 0.1, 0.0)]),
            goal=goal,
        )
        policy = GtspMpc()
        policy.act(world)
        scene = Scene(world, policy.config)
        maneuvers(Runner(scene), 0)
        freeing_pushes(Runner(scene), 0)
        way_out(scene)
