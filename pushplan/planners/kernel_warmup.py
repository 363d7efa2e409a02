"""Load the compiled kernels before the first call that has a deadline."""

from __future__ import annotations

import contextlib
import functools
from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np

from pushplan.control import waiting_twist
from pushplan.control.recovery import warm_up_recovery
from pushplan.motion.path_search_config import PathSearchConfig
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.renewing_follower import RenewingFollower
from pushplan.planners.registry import make_policy, policy_names
from pushplan.world import (
    Drive,
    GoalDisc,
    GoalLine,
    MaxIterations,
    Movables,
    Policy,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.policy_abilities import WarmsUp

_ITERATIONS = 600
"""Iterations of a planner that does not say how many it needs to use all of its kernels."""

_BLOCKED_ITERATIONS = 2500
"""Iterations after which planners have given up to drive straight on."""

_POSES = ((2.0, 5.0, 0.0), (2.05, 5.0, 0.1), (5.0, 5.35, 0.2))
"""At the start, between the headings of a lattice, and a little too close to a wall."""


@runtime_checkable
class CountsIterations(Protocol):
    """A planner that says after how many iterations it has used all of its kernels."""

    warm_up_iterations: int


def warm_up(*names: str) -> None:
    """Run each policy for a moment in small worlds, so that later calls find kernels loaded.

    Numba compiles a kernel on its first use after an installation (seconds) and loads it from its
    cache on the first use in a process. A controller calls this once when it starts; again for the
    same names it does nothing. A policy that `WarmsUp` says itself what is to be run.

    Args:
        names: planners or policies of `planner_names()` and `policy_names()`; all by default.

    Raises:
        UnknownNameError: if there is no such planner or policy.
    """
    for name in names or policy_names():
        _warm_up(name)


@functools.cache
def _warm_up(name: str) -> None:
    warm_up_policy(make_policy(name))


def warm_up_policy(policy: Policy) -> None:
    """Do as `warm_up` for a policy that was made already; it has to be reset afterwards."""
    if isinstance(policy, WarmsUp):
        policy.warm_up()
    elif isinstance(policy, PlanFollower):
        warm_up_recovery()
        stop = policy.stop
        for world in (_room(), _water()):
            with contextlib.suppress(Exception):  # it may be made for other worlds than these
                _plan_and_follow(policy, world)
        policy.stop = stop
        with contextlib.suppress(Exception):
            policy.planner.plan(_doorway(), stop=MaxIterations(_ITERATIONS))
        if not isinstance(getattr(policy.planner, "config", None), PathSearchConfig):
            return
        for drive in (Drive.DIFFERENTIAL, Drive.CAR):
            with contextlib.suppress(Exception):
                policy.planner.plan(_before_a_wall(drive), stop=MaxIterations(_BLOCKED_ITERATIONS))


def _plan_and_follow(policy: PlanFollower, world: World) -> None:
    planner = policy.planner
    enough = planner.warm_up_iterations if isinstance(planner, CountsIterations) else _ITERATIONS
    planner.plan(world, stop=MaxIterations(enough))
    fewer = MaxIterations(min(enough, _ITERATIONS))
    policy.stop = fewer
    policy.reset(world, np.random.default_rng(0))
    for step, pose in enumerate(_POSES):
        moved = world.moved(robot_pose=pose, time=0.1 * step)
        planner.plan(moved, stop=fewer)
        policy.act(moved)
        waiting_twist(moved)
    if isinstance(policy, RenewingFollower):  # it compares plans, farther on than this
        policy.interaction.sweep(world, np.array(_POSES))


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


def _doorway() -> World:
    """A doorway that a coarse grid misses."""
    wall = np.array([[5.9, 5.52], [6.1, 5.52], [6.1, 10.0], [5.9, 10.0]])
    static = StaticMap.build(
        polygons=[wall, wall * [1.0, -1.0] + [0.0, 10.0]], bounds=[0.0, 0.0, 10.0, 10.0]
    )
    return replace(_room(), static=static, movables=Movables.empty())


def _before_a_wall(drive: Drive) -> World:
    """A robot that has no room ahead; it may turn on the spot, or is a car that cannot."""
    square = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    robot = RobotModel.from_outline(
        0.5 * np.column_stack([np.cos(angles), np.sin(angles)]),
        mass=1.0,
        drive=drive,
        max_speed=1.0,
        max_turn_rate=1.0,
        min_turning_radius=1.0 if drive is Drive.CAR else 0.0,
    )
    static = StaticMap.build(
        polygons=[square + np.array([3.01, 5.0])], bounds=[0.0, 0.0, 10.0, 10.0]
    )
    return replace(_room(), robot=robot, static=static)


def _water() -> World:
    return replace(
        _room(),
        static=StaticMap.build(bounds=[0.0, 0.0, 10.0, 10.0]),
        goal=GoalLine(np.array([8.0, 5.0]), np.array([1.0, 0.0])),
    )
