"""Planning call: check the arguments, watch the clock, wrap up a result; for all planners."""

from __future__ import annotations

import math
import time
from functools import cached_property

import numpy as np

from pushplan.core import motion as core
from pushplan.world.checks import expect
from pushplan.world.plan import Plan, PlanResult, PlanStats, PlanStatus
from pushplan.world.scene import World
from pushplan.world.stop import AnyOf, Stop, StopCheck, check_rules, wants_own_budget

_ROUNDING = 1e-6
"""Fraction of a limit by which differences of a plan's rates may exceed it."""


class PlanningCall:
    """One call of a planner, from the time when this object is made.

    Args:
        world: as in `pushplan.world.Planner.plan`; the call's own is `World.for_planning`.
        stop: likewise.
        rng: likewise.
        default: the stop rule where none is given; nothing ends the call where this is None too.

    Raises:
        InvalidInputError: naming the argument that has a wrong type.
    """

    def __init__(
        self, world: object, stop: object, rng: object, default: Stop | None = None
    ) -> None:
        self.began = time.perf_counter()
        scene = expect("world", world, World)
        given, generator = check_rules(stop, rng)
        self.rng = np.random.default_rng(0) if generator is None else generator
        self._has_rng = generator is not None
        own = wants_own_budget(given)
        self.has_rule = not own
        """True if a rule of the caller takes the place of the planner's own budget."""
        self._rule = given
        if own and default is not None:  # `OwnBudget` in a rule stands for the default
            self._rule = default if given is None else AnyOf((given, default))
        self.arm()
        self.world = scene.for_planning()

    def arm(self) -> None:
        """Start the stop rule; again after what a process does in its first call only."""
        self.check: StopCheck = _never if self._rule is None else self._rule.start()

    @cached_property
    def seed(self) -> int:
        """The seed of planners that draw their numbers in the core; 0 without a generator."""
        return int(self.rng.integers(2**32)) if self._has_rng else 0

    @property
    def elapsed(self) -> float:
        """Time since the call began [s]."""
        return time.perf_counter() - self.began

    @property
    def cancelled(self) -> bool:
        """True if a cancellation token in the stop rule has been used."""
        return self._rule is not None and self._rule.cancelled

    @property
    def stopped_status(self) -> PlanStatus:
        """The status of a call that was stopped before there was a plan."""
        if self.cancelled:
            return PlanStatus.CANCELLED
        return PlanStatus.TIMED_OUT

    def result(
        self,
        status: PlanStatus,
        plan: Plan | None = None,
        first_solution_s: float = math.nan,
        iterations: int = 0,
        nodes: int = 0,
        **detail: float,
    ) -> PlanResult:
        """The result of the call, which has taken the time up to now; see `PlanStats`.

        A robot that cannot slow down may be unable to change its turn rate as fast as a plan does:
        then that is a path only.
        """
        robot = self.world.robot
        if plan is not None and not robot.can_stop:
            fastest = core.turn_acceleration(plan.turn_rates, plan.times)
            if fastest > robot.max_turn_acceleration * (1.0 + _ROUNDING):
                status = PlanStatus.PATH_ONLY
        stats = PlanStats(self.elapsed, first_solution_s, iterations, nodes, detail)
        return PlanResult(status, plan, stats)


def _never(iterations: int, cost: float) -> bool:
    return False
