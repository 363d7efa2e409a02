"""Growing trees with OMPL. Its random seed and log level are global: its users hold a lock."""

from __future__ import annotations

import atexit
import contextlib
import functools
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from ompl import base, util

from pushplan.world.checks import FloatArray

_LOCK = threading.Lock()
_POLL_S = 0.002


@functools.cache
def own_state(space: Callable[[], base.StateSpace]) -> Any:
    """The one state of a kind of space to hand values to OMPL with, which copies it.

    Its Python binding cannot free states (2.0.1), so one for each call would be lost.
    """
    return space().allocState()


atexit.register(own_state.cache_clear)  # else the binding complains about what is left


class GoalRegion(base.GoalSampleableRegion):
    """The goal as OMPL wants it: states to grow towards, and their distances from it."""

    def __init__(
        self,
        info: base.SpaceInformation,
        draw: Callable[[base.State], None],  # writes a state to grow towards
        distance: Callable[[base.State], float],  # of a state from the goal [m]; 0 inside
    ) -> None:
        super().__init__(info)
        self._draw = draw
        self._distance = distance
        self.setThreshold(np.finfo(np.float64).tiny)  # only a distance of 0 is below

    def sampleGoal(self, state: base.State) -> None:
        """Write a state to grow towards."""
        self._draw(state)

    def distanceGoal(self, state: base.State) -> float:
        """Distance of a state from the goal [m]."""
        return self._distance(state)

    def maxSampleCount(self) -> int:
        """More than any tree draws."""
        return 1_000_000_000


def grow_to(
    region: GoalRegion, planner: base.Planner, start: base.State, done: Callable[[], bool]
) -> Any | None:
    """The path of a tree to a region; None if ``done()``, asked in each iteration, comes first."""
    problem = base.ProblemDefinition(region.getSpaceInformation())
    problem.addStartState(start)
    problem.setGoal(region)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(base.PlannerTerminationCondition(done))
    return problem.getSolutionPath() if problem.hasExactSolution() else None


def plane_bounds(bounds: FloatArray) -> base.RealVectorBounds:
    """Bounds (4,) of a plane as OMPL has them."""
    made = base.RealVectorBounds(2)
    for axis in range(2):
        made.setLow(axis, float(bounds[axis]))
        made.setHigh(axis, float(bounds[axis + 2]))
    return made


@contextlib.contextmanager
def ompl_alone(stopped: Callable[[], bool]) -> Iterator[bool]:
    """Keep other threads from seeding OMPL inside the block, and OMPL from printing.

    Args:
        stopped: asked while another thread uses OMPL, so that waiting keeps to a stop rule.

    Yields:
        Whether OMPL is ours; False if ``stopped()`` came first.
    """
    ours = _LOCK.acquire(timeout=_POLL_S)
    while not ours and not stopped():
        ours = _LOCK.acquire(timeout=_POLL_S)
    try:
        if ours:
            util.setLogLevel(util.LogLevel.LOG_NONE)
        yield ours
    finally:
        if ours:
            _LOCK.release()
