"""`GivenPath`: a path that someone else has planned, as a planner."""

from __future__ import annotations

import numpy as np

from pushplan.planners.following.replanning import rest_of
from pushplan.planners.following.splicing import passed
from pushplan.world import Plan, PlanResult, PlanStatus, Stop, World
from pushplan.world.plan import PlanStats


class GivenPath:
    """A planner that returns the path that it was given, from where the robot is on it."""

    def __init__(self) -> None:
        self.given: Plan | None = None
        self.made = 0.0

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """The rest of the path."""
        if self.given is None:
            return PlanResult(PlanStatus.TIMED_OUT, None, PlanStats(0.0))
        index = passed(world, self.given, max(0.0, world.time - self.made))
        rest = rest_of(self.given, index, None)
        return PlanResult(PlanStatus.SOLVED, rest, PlanStats(0.0))
