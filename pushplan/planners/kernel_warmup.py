"""Load the compiled kernels before the first call that has a deadline."""

from __future__ import annotations

import contextlib
import functools
import math
from typing import Protocol, runtime_checkable

import numpy as np

from pushplan.control import waiting_twist
from pushplan.motion.path_search_config import PathSearchConfig
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.registry import make_policy, policy_names
from pushplan.planners.warm_up_worlds import warm_up_worlds
from pushplan.world import MaxIterations, Policy, World
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
        stop = policy.stop
        for world in warm_up_worlds("followers"):
            with contextlib.suppress(Exception):  # it may be made for other worlds than these
                _plan_and_follow(policy, world)
        policy.stop = stop
        _plan_in("doorway", policy, _ITERATIONS)
        if isinstance(getattr(policy.planner, "config", None), PathSearchConfig):
            _plan_in("no room ahead", policy, _BLOCKED_ITERATIONS)


def _plan_in(worlds: str, policy: PlanFollower, iterations: int) -> None:
    for world in warm_up_worlds(worlds):
        with contextlib.suppress(Exception):
            policy.planner.plan(world, stop=MaxIterations(iterations))


def _plan_and_follow(policy: PlanFollower, world: World) -> None:
    planner = policy.planner
    enough = _ITERATIONS
    if isinstance(planner, CountsIterations):
        enough = planner.warm_up_iterations
    planner.plan(world, stop=MaxIterations(enough))
    fewer = MaxIterations(min(enough, _ITERATIONS))
    policy.stop = fewer
    policy.reset(world, np.random.default_rng(0))
    for step, pose in enumerate(_POSES):
        moved = world.moved(robot_pose=pose, time=0.1 * step)
        planner.plan(moved, stop=fewer)
        policy.act(moved)
        waiting_twist(moved)
    if math.isfinite(policy.replanning.renewal):  # it compares plans, farther on than this
        policy.interaction.sweep(world, np.array(_POSES))
