"""Metrics by name. A function is imported when it is asked for."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal, cast

from pushplan.errors import describe, short
from pushplan.imports.named_objects import load_users
from pushplan.imports.on_demand import Registered
from pushplan.world import Episode, InvalidInputError, UnknownNameError

GoalKind = Literal["robot", "objects"]


class Role(enum.Enum):
    """Places in which results show a metric."""

    SCORE = "score"
    """Everywhere: a column, the tables, the plots, the page and the paired differences."""
    DETAIL = "detail"
    """As a score, but not in the tables of the terminal."""
    FACT = "fact"
    """A column and a line of the summary."""
    ON_REQUEST = "on request"
    """Nowhere, unless it is asked for by name."""


@dataclass(frozen=True)
class Metric:
    """One metric: everything that rows, tables, pages and plots need to know about it.

    Args:
        function: ``"module:function"``; takes an `Episode` and gives a number, or None where the
            metric does not apply.
        role: where results show it.
        heading: of its column in tables, with the unit; the name if empty.
        higher_is_better: None where neither is.
        goal: who has the goal in the tasks that it is for; None for all tasks.
        digits: after the point, in tables.
        if_failed: its value for a job that failed; None for no value. A score that cannot fall
            below this has one, so that failures do not raise the mean.
        until_failure: what was recorded before a job failed still counts.
        whole: values are whole numbers.
        low: least value that it can have.
        high: greatest value that it can have.
    """

    function: str
    role: Role = Role.SCORE
    heading: str = ""
    higher_is_better: bool | None = True
    goal: GoalKind | None = None
    digits: int = 3
    if_failed: float | None = None
    until_failure: bool = False
    whole: bool = False
    low: float = 0.0
    high: float = math.inf


_NAVIGATION = "pushplan.metrics.navigation"
_MANIPULATION = "pushplan.metrics.manipulation"
_PUSHES = "pushplan.metrics.pushes"
_FACTS = "pushplan.metrics.lengths"
_ASKED_FOR = partial(Metric, role=Role.ON_REQUEST, goal="objects")

_METRICS: dict[str, Metric] = {
    "success": Metric(f"{_FACTS}:success", Role.ON_REQUEST),
    "E_nav": Metric(f"{_NAVIGATION}:e_nav", goal="robot", if_failed=0.0, high=1.0),
    "I_nav": Metric(f"{_NAVIGATION}:i_nav", goal="robot", high=1.0),
    "S_manip": Metric(f"{_MANIPULATION}:s_manip", goal="objects", if_failed=0.0, high=1.0),
    "E_manip": Metric(f"{_MANIPULATION}:e_manip", goal="objects", if_failed=0.0),
    "I_manip": Metric(f"{_MANIPULATION}:i_manip", goal="objects", high=1.0),
    "E_nav_to_goal_point": _ASKED_FOR(f"{_NAVIGATION}:e_nav_to_goal_point", goal="robot"),
    "E_manip_reference": _ASKED_FOR(f"{_MANIPULATION}:e_manip_reference"),
    "I_manip_reference": _ASKED_FOR(f"{_MANIPULATION}:i_manip_reference"),
    "place_error_m": _ASKED_FOR(f"{_MANIPULATION}:place_error", higher_is_better=False),
    "heading_error_rad": _ASKED_FOR(f"{_MANIPULATION}:heading_error", higher_is_better=False),
    **{
        name: _ASKED_FOR(f"{_PUSHES}:{name}", higher_is_better=False)
        for name in ("pushes", "relocations", "transit_distance_m")
    },
    "pushing_distance_m": _ASKED_FOR(f"{_PUSHES}:pushing_distance_m", higher_is_better=None),
    "made_unsolvable": Metric(
        "pushplan.metrics.closing:made_unsolvable",
        Role.ON_REQUEST,
        "closed for good",
        higher_is_better=False,
        goal="robot",
        high=1.0,
    ),
    "path_length_m": Metric(
        f"{_FACTS}:robot_path_length", Role.DETAIL, "path [m]", higher_is_better=False
    ),
    "interaction_work_kg_m": Metric(
        f"{_FACTS}:interaction_work", Role.DETAIL, "work [kg m]", higher_is_better=False
    ),
    "steps": Metric(
        f"{_FACTS}:steps", Role.FACT, higher_is_better=None, until_failure=True, whole=True
    ),
    "sim_time_s": Metric(
        f"{_FACTS}:sim_time_s", Role.FACT, "time [s]", higher_is_better=None, until_failure=True
    ),
}
METRICS = {
    name: _METRICS.get(name) or Metric(function, Role.DETAIL, higher_is_better=None)
    for name, function in Registered(
        "pushplan.metrics", {name: metric.function for name, metric in _METRICS.items()}
    ).items()
}
"""All metrics, in the order of the columns. A line above is all that a new one needs."""


def metric_names(*roles: Role) -> tuple[str, ...]:
    """The names that `compute` knows, of some roles or of all."""
    return tuple(name for name, metric in METRICS.items() if not roles or metric.role in roles)


def compute(episode: Episode, names: Iterable[str] | None = None) -> Mapping[str, float]:
    """The value of each metric that applies to an episode.

    Args:
        episode: the recorded run.
        names: metrics by name, or functions as ``"module:function"`` or
            ``"file.py:function"``; all Registered ones if None.

    Raises:
        UnknownNameError: if there is no such metric.
        InvalidInputError: if a metric returns something that is no number.
    """
    kind = episode.world.goal_kind
    values: dict[str, float] = {}
    for name in METRICS if names is None else names:
        function = metric_function(name)
        if name in METRICS and METRICS[name].goal not in (kind, None):
            continue
        try:
            value = function(episode)
        except Exception as error:
            if name in METRICS:
                raise
            raise InvalidInputError(f"metric {name!r} raised {describe(error)}") from error
        if value is None:
            continue
        try:
            values[name] = float(value)
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidInputError(
                f"metric {name!r} must return a number or None, got {short(value)}"
            ) from error
        if math.isnan(values[name]):  # as None: the metric has no value here
            del values[name]
    return values


def metric_function(name: str) -> Callable[[Episode], float | None]:
    """A metric by name, ``"module:function"`` or ``"file.py:function"``.

    Raises:
        UnknownNameError: if there is no such metric.
        InvalidInputError: if there is no such file, module or function, or loading it raises.
    """
    target = METRICS[name].function if name in METRICS else name
    if ":" not in target:
        raise UnknownNameError("metric", name, METRICS)
    return cast("Callable[[Episode], float | None]", load_users("metric", target))
