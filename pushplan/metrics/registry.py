"""Metrics by name. An entry is imported when it is asked for."""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterable, Mapping
from typing import Any

from pushplan.world import Episode, InvalidInputError, UnknownNameError

METRICS: dict[str, str] = {
    "success": "pushplan.metrics.common:success",
    "E_nav": "pushplan.metrics.navigation:e_nav",
    "I_nav": "pushplan.metrics.navigation:i_nav",
    "S_manip": "pushplan.metrics.manipulation:s_manip",
    "E_manip": "pushplan.metrics.manipulation:e_manip",
    "I_manip": "pushplan.metrics.manipulation:i_manip",
    "E_nav_to_goal_point": "pushplan.metrics.navigation:e_nav_to_goal_point",
    "E_manip_straight": "pushplan.metrics.manipulation:e_manip_straight",
    "path_length_m": "pushplan.metrics.lengths:robot_path_length",
    "interaction_work_kg_m": "pushplan.metrics.lengths:interaction_work",
    "steps": "pushplan.metrics.common:steps",
    "sim_time_s": "pushplan.metrics.common:sim_time_s",
}
"""Name -> "module:function"; a function of an `Episode` that returns a number, or None where the
metric does not apply to the task. Names that are columns of the results fill those columns."""


def metric_names() -> tuple[str, ...]:
    """The names that `compute` knows."""
    return tuple(METRICS)


def compute(episode: Episode, names: Iterable[str] | None = None) -> Mapping[str, float]:
    """The value of each metric that applies to an episode.

    Args:
        episode: the recorded run.
        names: metrics by name, or functions as ``"module:function"``; all registered ones if
            None.

    Raises:
        UnknownNameError: if there is no such metric.
        InvalidInputError: if a metric returns something that is no number.
    """
    values: dict[str, float] = {}
    for name in METRICS if names is None else names:
        value = _load(name)(episode)
        if value is None:
            continue
        try:
            values[name] = float(value)
        except (TypeError, ValueError) as error:
            raise InvalidInputError(
                f"metric {name!r} must return a number or None, got {value!r:.60}"
            ) from error
        if math.isnan(values[name]):
            del values[name]
    return values


def _load(name: str) -> Any:
    target = METRICS.get(name, name)
    module, colon, attribute = target.partition(":")
    if not colon:
        raise UnknownNameError("metric", name, METRICS)
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise InvalidInputError(f"cannot load metric {name!r}: {error}") from error
