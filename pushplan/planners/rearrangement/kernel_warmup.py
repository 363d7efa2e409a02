"""Load the compiled kernels of the manipulation policies before they are needed."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.control.recovery import warm_up_recovery
from pushplan.geometry.transforms import arc_step
from pushplan.gtsp import warm_up_solver
from pushplan.planners.pushing import warm_up as warm_up_pushing
from pushplan.planners.rearrangement.approach import approach_tree
from pushplan.planners.rearrangement.controller_kernels import steer_push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.relocation import relocating_pushes
from pushplan.world import (
    ClearanceArea,
    Movables,
    Policy,
    Receptacle,
    StaticMap,
    World,
    box_delivery_robot,
)

_STEPS = 150
_PERIOD = 0.2  # [s]
_WEDGED = (-2.2, -0.985, 0.0)  # A box a little in one of the columns


@functools.cache
def warm_up_rearrangement() -> None:
    """Solve, push and look for every kind of push; no kernel is for one kind of task alone."""
    warm_up_solver(proof=False)
    warm_up_pushing()
    scene = PushScene(_worlds()[0], RearrangementConfig())
    relocating_pushes(PushSimulator(scene), 0, approach_tree(scene))
    warm_up_recovery()


@functools.cache
def warm_up_steering() -> None:
    """Steer a push outside rollouts, as `GeometricPusher` does; few episodes come to that."""
    here, scene = np.zeros(3), PushScene(_worlds()[0], RearrangementConfig())
    steer_push(here, here, np.eye(2), 0.0, 0.0, scene.controller)


@functools.cache
def drive_in_small_worlds(policy: Callable[[], Policy]) -> None:
    """Let a new policy plan and drive for boxes in each kind of task."""
    for world in _worlds():
        driven = policy()
        for _ in range(_STEPS):
            world = _driven(world, driven.act(world, None))


def _worlds() -> list[World]:
    """One small world for each kind of goal.

    The robot starts between two columns that leave it no clearance to turn about, and its boxes do
    not move: it has to get out, get to a box, push and plan again.
    """
    square = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
    columns = [0.2 * square + (-2.2, y) for y in (-2.7, -1.3)]
    goals = (
        ClearanceArea(3.0 * square, np.array([True, False, False, False])),
        Receptacle(square + 2.5),
    )
    return [
        World(
            robot=box_delivery_robot(),
            robot_pose=np.array([-2.2, -2.0, 0.0]),
            static=StaticMap.build(polygons=columns, bounds=(-3.0, -3.0, 3.0, 3.0)),
            movables=Movables.from_outlines(2 * [0.44 * square], [(0.2, 0.1, 0.0), _WEDGED]),
            goal=goal,
        )
        for goal in goals
    ]


def _driven(world: World, twist: Any) -> World:
    """A step later, when nothing is in the robot's way."""
    pose = np.empty(3)
    arc_step(np.array(world.robot_pose), _PERIOD * twist.linear, _PERIOD * twist.angular, pose)
    return world.moved(robot_pose=pose, time=world.time + _PERIOD)
