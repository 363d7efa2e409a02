"""Load the compiled kernels before the first call that has a deadline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pushplan.control import MpcTracker
from pushplan.planners.policy import PlanFollower
from pushplan.planners.registry import OPEN_WATER, make_planner, planner_names
from pushplan.planners.sequencing import warm_up_solver
from pushplan.planners.subtasks.warming import warm_up_subtasks
from pushplan.world import (
    Drive,
    GoalDisc,
    GoalLine,
    MaxIterations,
    Movables,
    RobotModel,
    StaticMap,
    World,
)

_ENOUGH = {"push-aware": 6000}
"""Iterations after which all kernels of a planner have been used, where 600 are not enough."""

_PUSHERS = ("greedy", "gtsp", "gtsp-mpc")


def warm_up(*names: str) -> None:
    """Plan once in a small room with each planner, so that later calls find compiled kernels.

    Numba compiles a kernel on its first use after an installation (seconds) and loads it from its
    cache on the first use in a process (a second or so, three for ``push-aware``). A controller
    calls this once when it starts.

    Args:
        names: planners, and policies that push objects to a goal; all by default.

    Raises:
        UnknownNameError: if there is no such planner.
    """
    square = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    corner = square + np.array([5.0, 6.3])  # for the straight way to go round
    room = World(
        robot=RobotModel.from_outline(
            square, mass=1.0, drive=Drive.CONSTANT_SPEED, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=np.array([2.0, 5.0, 0.0]),
        static=StaticMap.build(polygons=[square + 8.0, corner], bounds=[0.0, 0.0, 10.0, 10.0]),
        movables=Movables.from_outlines([square, square], [[4.0, 5.0, 0.0], [5.2, 5.0, 0.0]]),
        goal=GoalDisc(np.array([8.0, 5.0]), 0.5),
    )
    water = replace(
        room,
        static=StaticMap.build(bounds=[0.0, 0.0, 10.0, 10.0]),
        goal=GoalLine(np.array([8.0, 5.0]), np.array([1.0, 0.0])),
    )
    if not names:
        warm_up_solver()
    if not names or set(names) & set(_PUSHERS):
        warm_up_subtasks()
    for name in [name for name in names if name not in _PUSHERS] if names else planner_names():
        world, enough = (water, 30) if name in OPEN_WATER else (room, 600)
        planner = make_planner(name)
        planner.plan(world, stop=MaxIterations(_ENOUGH.get(name, enough)))
        if world is room:  # some go about it in another way where nothing is static
            planner.plan(water, stop=MaxIterations(enough))
        policy = PlanFollower(planner, MpcTracker() if name.startswith("ship") else None)
        policy.stop = MaxIterations(enough)
        for step in range(3):
            policy.act(world.moved(time=0.1 * step))
