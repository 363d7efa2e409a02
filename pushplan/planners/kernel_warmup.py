"""Load the compiled kernels before the first call that has a deadline."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from pushplan.control import MpcTracker
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.rearrangement.kernel_warmup import warm_up_rearrangement
from pushplan.planners.registry import OPEN_WATER, make_planner, planner_names
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

_POSES = ((2.0, 5.0, 0.0), (2.05, 5.0, 0.1), (5.0, 5.35, 0.2))
"""At the start, between the headings of a lattice, and a little too close to a wall."""

_PUSHERS = ("greedy", "gtsp", "gtsp-mpc")
_PLANNER_OF = {"push-aware-constant-speed": "push-aware"}
_NO_KERNELS = ("random",)


def warm_up(*names: str) -> None:
    """Plan a few times in a small room with each planner, so that later calls find kernels loaded.

    Numba compiles a kernel on its first use after an installation (seconds) and loads it from its
    cache on the first use in a process (a second or so, three for those that push objects to a
    goal). A controller calls this once when it starts; again for the same names it does nothing.

    Args:
        names: planners or policies of `planner_names()` and `policy_names()`; all by default.

    Raises:
        UnknownNameError: if there is no such planner.
    """
    wanted = dict.fromkeys(_PLANNER_OF.get(name, name) for name in names or planner_names())
    if not names or set(names) & set(_PUSHERS):
        warm_up_rearrangement()
    for name in wanted:
        if name not in (*_PUSHERS, *_NO_KERNELS):
            _warm_up_planner(name)


@functools.cache
def _warm_up_planner(name: str) -> None:
    planner = make_planner(name)
    room, water = _room(), _water()
    world, enough = (water, 30) if name in OPEN_WATER else (room, 600)
    planner.plan(world, stop=MaxIterations(_ENOUGH.get(name, enough)))
    if world is room:  # some go about it in another way where nothing is static
        planner.plan(water, stop=MaxIterations(enough))
    policy = PlanFollower(planner, MpcTracker() if name.startswith("ship") else None)
    policy.stop = MaxIterations(enough)
    for step, pose in enumerate(_POSES):
        moved = world.moved(robot_pose=pose, time=0.1 * step)
        planner.plan(moved, stop=MaxIterations(enough))
        policy.act(moved)


def _room() -> World:
    square = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    corner = square + np.array([5.0, 6.3])  # for the straight way to go round
    return World(
        robot=RobotModel.from_outline(
            square, mass=1.0, drive=Drive.CONSTANT_SPEED, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=np.array(_POSES[0]),
        static=StaticMap.build(polygons=[square + 8.0, corner], bounds=[0.0, 0.0, 10.0, 10.0]),
        movables=Movables.from_outlines([square, square], [[4.0, 5.0, 0.0], [5.2, 5.0, 0.0]]),
        goal=GoalDisc(np.array([8.0, 5.0]), 0.5),
    )


def _water() -> World:
    return replace(
        _room(),
        static=StaticMap.build(bounds=[0.0, 0.0, 10.0, 10.0]),
        goal=GoalLine(np.array([8.0, 5.0]), np.array([1.0, 0.0])),
    )
