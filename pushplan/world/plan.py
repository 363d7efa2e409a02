"""Result of a planner: status, plan and statistics."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, expect, frozen
from pushplan.world.polyline import arc_lengths, path_length

if TYPE_CHECKING:
    from collections.abc import Mapping


class PlanStatus(enum.Enum):
    """Outcome of a planning call; ``remedy`` says what the caller can do about it."""

    SOLVED = ("solved", "Follow the plan.")
    APPROXIMATE = (
        "approximate",
        "The plan ends short of the goal: follow it and plan again from there, or allow more time.",
    )
    PATH_ONLY = (
        "path_only",
        "The plan is a path only: the robot stands at another heading, turns slower than the path "
        "or changes its turn rate slower, or touches something static on it. Let a controller "
        "follow it, or plan with kinodynamic-rrt or push-aware.",
    )
    TIMED_OUT = (
        "timed_out",
        "No plan was found before the stop rule fired: allow more time or iterations, "
        "or lower the weight of pushing.",
    )
    CANCELLED = ("cancelled", "The call was cancelled before there was a plan: call again.")
    START_BLOCKED = (
        "start_blocked",
        "The robot starts in collision with something static, or has no room ahead, nor behind if "
        "it can reverse, to get away: check the pose and the footprint, or drive clear first.",
    )
    GOAL_UNREACHABLE = (
        "goal_unreachable",
        "No path leads to the goal around the static obstacles: check the map, the bounds and "
        "the footprint.",
    )
    WAY_CLOSED = (
        "way_closed",
        "Objects close every way to the goal, and no push was found that opens one: check which "
        "objects are held not to move, or allow more pushes.",
    )

    def __init__(self, label: str, remedy: str) -> None:
        self.label = label
        self.remedy = remedy

    @property
    def has_plan(self) -> bool:
        """True if a result of this status carries a plan."""
        return self in (PlanStatus.SOLVED, PlanStatus.APPROXIMATE, PlanStatus.PATH_ONLY)


@dataclass(frozen=True, eq=False)
class SubTask(ArrayRecord):
    """One step of a manipulation plan: which objects are pushed, over which poses of the plan.

    Args:
        object_ids: the objects that this push takes along.
        first: index of the first pose of the plan that belongs to it.
        last: index of the last pose, inclusive.
    """

    object_ids: tuple[int, ...]
    first: int
    last: int


class Stage(NamedTuple):
    """A part of a plan that is driven in one direction; the next one begins where it ends."""

    first: int  # index of its first pose
    last: int  # index of its last pose
    direction: int  # 1 ahead, -1 back, 0 for a turn on the spot


@dataclass(frozen=True, eq=False)
class Plan(ArrayRecord, CheckedFields):
    """A time-stamped path of the robot with its expected price.

    Args:
        times: (N,) seconds since the snapshot that was planned from, not decreasing, from 0.
        poses: (N, 3) x, y [m], theta [rad], world frame.
        speeds: (N,) forward speed from each pose on [m/s], negative for back; 0 with a turn rate
            for a turn on the spot.
        turn_rates: (N,) turn rate from each pose on [rad/s].
        travel_cost: robot mass times path length [kg m].
        interaction_cost: expected sum of object mass times path length [kg m].
        object_poses: (N, K, 3) where the objects are expected to be at each time, or None where
            the planner makes no prediction. Fixed objects count as static and are left out.
        subtasks: the pushes in order, for manipulation.
    """

    field_prefix = "plan."

    times: Annotated[FloatArray, Shape("N")]
    poses: Annotated[FloatArray, Shape("N", 3)]
    speeds: Annotated[FloatArray, Shape("N")]
    turn_rates: Annotated[FloatArray, Shape("N")]
    travel_cost: NonNegativeFloat
    interaction_cost: NonNegativeFloat = 0.0
    object_poses: Annotated[FloatArray, Shape("N", None, 3)] | None = None
    subtasks: tuple[SubTask, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.times) == 0:
            raise InvalidInputError("a plan needs at least one pose")
        if self.times[0] < 0.0 or (np.diff(self.times) < 0.0).any():
            raise InvalidInputError("plan.times must start at 0 or later and not decrease")

    @property
    def cost(self) -> float:
        """Travel plus interaction [kg m]."""
        return self.travel_cost + self.interaction_cost

    @property
    def duration(self) -> float:
        """Time from the first to the last pose [s]."""
        return float(self.times[-1] - self.times[0])

    @property
    def length(self) -> float:
        """Path length of the robot [m]."""
        return path_length(self.poses)

    @cached_property
    def arc_lengths(self) -> FloatArray:
        """(N,) path length of the robot up to each pose [m]."""
        return frozen(arc_lengths(self.poses))

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """Its parts that are driven ahead, back, or on the spot, in order; at least one."""
        on_spot = (self.speeds == 0.0) & (self.turn_rates != 0.0)
        kinds = np.where(self.speeds < 0.0, -1.0, 1.0)
        kinds[on_spot] = 2.0 * np.sign(self.turn_rates[on_spot])
        cuts = (np.flatnonzero(np.diff(kinds[:-1])) + 1).tolist()
        ends = pairwise([0, *cuts, len(self.times) - 1])
        return tuple(Stage(a, b, int(kinds[a]) if abs(kinds[a]) == 1.0 else 0) for a, b in ends)


@dataclass(frozen=True)
class PlanStats:
    """Statistics of a planning call.

    Args:
        wall_time_s: time inside the call [s].
        first_solution_s: time until the first plan that reaches the goal [s], NaN if none.
        iterations: how often the planner's main loop ran.
        nodes: states of its search that are part of the paths it looked at closer.
        detail: further numbers of the algorithm, by name.
    """

    wall_time_s: float
    first_solution_s: float = float("nan")
    iterations: int = 0
    nodes: int = 0
    detail: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class PlanResult:
    """Outcome of one planning call. ``plan`` is set exactly when ``status.has_plan``."""

    status: PlanStatus
    plan: Plan | None
    stats: PlanStats

    def __post_init__(self) -> None:
        expect("status of a result", self.status, PlanStatus)
        if (self.plan is not None) != self.status.has_plan:
            raise InvalidInputError(
                f"a result with status {self.status.label} must "
                f"{'have a' if self.status.has_plan else 'not have a'} plan"
            )
