"""A planning call beside driving, and the plan that comes of it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np

from pushplan.planners.following.replanning import Reason, rest_of
from pushplan.planners.following.splicing import joined, passed
from pushplan.world import (
    InvalidInputError,
    PendingResult,
    Plan,
    Planner,
    PlanResult,
    Stop,
    World,
)
from pushplan.world.checks import expect


@runtime_checkable
class PreparedPlanner(Protocol):
    """A planner that makes what depends on the robot alone before its first call."""

    def prepare(self, world: World) -> None:
        """Make it; it is kept."""
        ...


@dataclass(frozen=True)
class PendingPlan:
    """A planning call whose plan may not be there yet.

    Args:
        call: gives the result when it is there.
        start: the snapshot that it plans from.
        stretch: what is driven until the plan begins; None for nothing.
        reason: why the plan is wanted.
        made: when it was asked for, by the clock of the world [s].
    """

    call: PendingResult[PlanResult]
    start: World
    stretch: Plan | None
    reason: Reason
    made: float

    def from_now_on(self, plan: Plan, world: World) -> Plan:
        """The plan of this call, without the part that the robot has driven meanwhile.

        Args:
            plan: what the planner returned.
            world: the scene now.

        Raises:
            InvalidInputError: if the plan begins elsewhere, or predicts other objects.
        """
        _check(plan, self.start)
        whole = joined(self.stretch, plan)
        seconds = world.time - self.made
        if seconds <= 0.0:
            return whole
        return rest_of(whole, passed(world, whole, seconds), None)


def timed_call(
    planner: Planner, start: World, rng: np.random.Generator, stop: Stop | None
) -> PlanResult:
    """The result of a planner, with the time that it took by our clock."""
    began = time.perf_counter()
    result = planner.plan(start, stop=stop, rng=rng)
    took = time.perf_counter() - began
    result = expect("what the planner returns", result, PlanResult)
    return replace(result, stats=replace(result.stats, wall_time_s=took))


def without_predictions(result: PlanResult) -> PlanResult:
    """The same result without the objects' predicted poses, which take most of its memory."""
    if result.plan is None or result.plan.object_poses is None:
        return result
    return replace(result, plan=replace(result.plan, object_poses=None))


def _check(plan: Plan, start: World) -> None:
    """Refuse a plan that is not one for this snapshot."""
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
