"""CPU time of a planning call, measured in one way by all benchmarks."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from pushplan.planners import make_planner
from pushplan.world import Deadline, PlanResult, World
from pushplan.world.stop import Stop, StopCheck


@dataclass(frozen=True)
class CpuDeadline(Deadline):
    """A deadline that other processes on the machine do not shorten."""

    def start(self) -> StopCheck:
        """Arm the rule: the clock of this thread starts now."""
        end = time.thread_time() + self.budget_s
        return lambda iterations, cost: time.thread_time() >= end


def timed_plan(
    name: str, world: World, stop: Stop, seed: int | None = None
) -> tuple[float, PlanResult]:
    """CPU time [s] of a call of a planner, infinite where it has no plan, and its result."""
    planner = make_planner(name)
    rng = None if seed is None else np.random.default_rng(seed)
    began = time.thread_time()
    result = planner.plan(world, stop=stop, rng=rng)
    spent = time.thread_time() - began
    return (spent if result.plan is not None else np.inf), result
