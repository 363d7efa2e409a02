"""Load the compiled kernels of sampling-based control before they are needed."""

from __future__ import annotations

import functools

import numpy as np

from pushplan.planners.mppi.mppi import Mppi
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.mppi_policy import MppiPolicy
from pushplan.world import (
    ClearanceArea,
    Drive,
    Goal,
    GoalDisc,
    GoalLine,
    Movables,
    Receptacle,
    StaticMap,
    World,
    box_delivery_robot,
)

_SQUARE = 0.2 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


@functools.cache
def warm_up_mppi() -> None:
    """Decide a few times in a small world for each kind of goal."""
    for world in _worlds():
        policy = MppiPolicy(Mppi(MppiConfig(samples=16)))
        policy.reset(world, np.random.default_rng(0))
        for step in range(2):
            policy.act(world.moved(time=10.0 * step))


def _worlds() -> list[World]:
    constant, free = Drive.CONSTANT_SPEED, Drive.DIFFERENTIAL
    sides = np.ones(4, np.bool_)
    goals: list[tuple[Drive, bool, Goal]] = [
        (constant, True, GoalDisc(np.array([2.5, 0.0]), 0.2)),
        (constant, False, GoalLine(np.array([2.5, 0.0]), np.array([1.0, 0.0]))),
        (free, True, Receptacle(4.0 * _SQUARE + 2.0)),
        (free, False, ClearanceArea(8.0 * _SQUARE, sides)),
    ]
    columns = [_SQUARE + np.array([0.0, -2.0])]
    return [
        World(
            robot=box_delivery_robot(drive),
            robot_pose=np.array([-2.0, 0.0, 0.0]),
            static=StaticMap.build(
                polygons=columns if walls else [], bounds=(-3.0, -3.0, 3.0, 3.0)
            ),
            movables=Movables.from_outlines([_SQUARE, _SQUARE], [(-1.2, 0, 0.3), (0.5, 0.2, 0)]),
            goal=goal,
        )
        for drive, walls, goal in goals
    ]
