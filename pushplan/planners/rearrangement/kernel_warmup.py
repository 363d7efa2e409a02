"""Load the compiled kernels of the manipulation policies before they are needed."""

from __future__ import annotations

import functools

import numpy as np

from pushplan.gtsp import warm_up_solver
from pushplan.planners.pushing import warm_up as warm_up_pushing
from pushplan.planners.rearrangement.extraction import maneuvers
from pushplan.planners.rearrangement.gtsp_mpc import GtspMpc
from pushplan.planners.rearrangement.pre_relocation import freeing_pushes
from pushplan.planners.rearrangement.recovery import stepped, way_out
from pushplan.planners.rearrangement.runner import Runner
from pushplan.planners.rearrangement.scene import Scene
from pushplan.world import (
    ClearanceArea,
    Movables,
    Receptacle,
    StaticMap,
    Twist,
    World,
    box_delivery_robot,
)

_STEPS = 150
_PERIOD = 0.2  # [s]
_WEDGED = (-2.2, -0.985, 0.0)
"""A box a little in one of the columns."""


@functools.cache
def warm_up_subtasks() -> None:
    """Plan and drive for boxes in each kind of task, so that every step of an episode is quick.

    The robot starts between two columns that leave it no room to turn about, and its boxes do not
    move: it has to get out, get to a box, push and plan again. A second call does nothing.
    """
    warm_up_solver()
    warm_up_pushing()
    square = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
    columns = [0.2 * square + (-2.2, y) for y in (-2.7, -1.3)]
    for goal in (
        ClearanceArea(3.0 * square, np.array([True, False, False, False])),
        Receptacle(square + 2.5),
    ):
        world = World(
            robot=box_delivery_robot(),
            robot_pose=np.array([-2.2, -2.0, 0.0]),
            static=StaticMap.build(polygons=columns, bounds=(-3.0, -3.0, 3.0, 3.0)),
            movables=Movables.from_outlines(2 * [0.44 * square], [(0.2, 0.1, 0.0), _WEDGED]),
            goal=goal,
        )
        policy = GtspMpc()
        scene = Scene(world, policy.config)
        maneuvers(Runner(scene), 0)
        freeing_pushes(Runner(scene), 0)
        way_out(scene)
        for _ in range(_STEPS):
            world = _driven(world, policy.act(world))


def _driven(world: World, twist: Twist) -> World:
    """A step later, when nothing is in the robot's way."""
    here = np.array(world.robot_pose)
    pose = stepped(here, _PERIOD * twist.linear, _PERIOD * twist.angular)
    return world.moved(robot_pose=pose, time=world.time + _PERIOD)
