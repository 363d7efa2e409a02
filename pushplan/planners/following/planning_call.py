"""A planning call beside driving, and the plan that comes of it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np

from pushplan.planners.following.replanning import Comparison, Reason, rest_of
from pushplan.planners.following.splicing import joined, passed
from pushplan.world import InvalidInputError, PendingResult, Plan, Planner, PlanResult, Stop, World
from pushplan.world.checks import expect
from pushplan.world.protocols import HasAttributes


@runtime_checkable
class PreparedPlanner(HasAttributes, Protocol):
    """A planner that makes what depends on the robot alone before its first call."""

    def prepare(self, world: World) -> None:
        """Make it; it is kept."""
        ...


@dataclass(frozen=True)
class Answer:
    """Outcome of a planning call, ready to be driven.

    Args:
        result: of the planner.
        plan: its plan, joined to what is driven until that begins; None if it has none.
        kept: the rest of the plan that was driven, where the new one is not cheaper.
    """

    result: PlanResult
    plan: Plan | None = None
    kept: Plan | None = None


@dataclass(frozen=True)
class PlanRequest:
    """Plans, and does all that makes a plan ready to be driven: that keeps commands short.

    Args:
        planner: makes the plan.
        start: the snapshot that it plans from.
        stretch: what is driven until the plan begins; None for nothing.
        rng: the planner's randomness.
        comparison: of the new plan with the present one; None to take up any.
    """

    planner: Planner
    start: World
    stretch: Plan | None
    rng: np.random.Generator
    comparison: Comparison | None

    def __call__(self, stop: Stop | None) -> Answer:
        """Return the answer; the result has the time that the planner took by our clock.

        Raises:
            InvalidInputError: if the plan begins elsewhere, or predicts other objects.
        """
        began = time.perf_counter()
        result = self.planner.plan(self.start, stop=stop, rng=self.rng)
        took = time.perf_counter() - began
        result = expect("what the planner returns", result, PlanResult)
        result = replace(result, stats=replace(result.stats, wall_time_s=took))
        if result.plan is None:
            return Answer(result)
        check_plan(result.plan, self.start)
        plan = joined(self.stretch, result.plan)
        if self.comparison is None:
            return Answer(result, plan)
        return Answer(result, plan, self.comparison.rest_unless_cheaper(plan))


@dataclass(frozen=True)
class PendingPlan:
    """A planning call whose plan may not be there yet.

    Args:
        call: gives the answer when it is there.
        start: the snapshot that it plans from.
        reason: why the plan is wanted.
        made: when it was asked for, by the clock of the world [s].
    """

    call: PendingResult[Answer]
    start: World
    reason: Reason
    made: float

    def from_now_on(self, plan: Plan, world: World) -> Plan:
        """A plan of the answer, without the part that the robot has driven meanwhile."""
        seconds = world.time - self.made
        if seconds <= 0.0:
            return plan
        return rest_of(plan, passed(world, plan, seconds), None)


def without_predictions(result: PlanResult) -> PlanResult:
    """The same result without the objects' predicted poses, which take most of its memory."""
    if result.plan is None or result.plan.object_poses is None:
        return result
    return replace(result, plan=replace(result.plan, object_poses=None))


def check_plan(plan: Plan, start: World) -> None:
    """Refuse a plan that is not one for this snapshot.

    Raises:
        InvalidInputError: if it begins elsewhere, or predicts other objects.
    """
    (x, y) = plan.poses[0, :2].tolist()
    (x0, y0) = start.robot_pose[:2].tolist()
    most = start.robot.circumscribed_radius
    if math.hypot(x - x0, y - y0) > most:
        raise InvalidInputError(
            f"plan.poses must begin within {most:g} m of the robot, which is at [{x0:g}, {y0:g}], "
            f"got [{x:g}, {y:g}]"
        )
    count = len(start.movables)
    if plan.object_poses is not None and plan.object_poses.shape[1] != count:
        raise InvalidInputError(
            f"plan.object_poses must be ({len(plan.poses)}, {count}, 3) for the {count} objects of "
            f"the world, got {plan.object_poses.shape}"
        )
