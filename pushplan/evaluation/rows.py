"""One row of the results: what became of one job."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from pushplan.metrics import compute, metric_names
from pushplan.world import Episode


class Status(enum.StrEnum):
    """How a job ended. Only `DONE` means that the episode ran to its own end."""

    DONE = "done"
    """The episode ended by the rules of its task, with or without success."""
    POLICY_ERROR = "policy_error"
    """The policy raised an exception or could not be made."""
    INVALID_ACTION = "invalid_action"
    """The policy returned an action that is not finite or has the wrong shape or type."""
    TIMEOUT = "timeout"
    """The job took longer than the wall-clock limit of an episode."""
    OUT_OF_MEMORY = "out_of_memory"
    """An allocation failed."""
    CRASHED = "crashed"
    """The worker process died."""
    ENV_ERROR = "env_error"
    """The environment raised an exception."""


@dataclass(frozen=True)
class ResultRow:
    """The columns of ``results.csv``, in order; None is an empty field.

    Attributes:
        policy: label of the policy.
        task: name of the task.
        simulator: name of the simulator.
        scenario: key of the scenario.
        seed: seed of the scenario.
        status: a value of `Status`.
        reason: why the episode ended; for a failed job what went wrong.
        success: whether the task's goal was reached.
        E_nav: efficiency of navigation; 0 for a job that failed.
        I_nav: effort of navigation.
        S_manip: success of manipulation; 0 for a job that failed.
        E_manip: efficiency of manipulation; 0 for a job that failed.
        I_manip: effort of manipulation.
        path_length_m: length of the robot's path [m].
        interaction_work_kg_m: sum of object mass times path length [kg m].
        steps: actions sent to the environment.
        sim_time_s: simulated time [s].
        wall_time_s: time that the episode took [s].
        plan_calls: planning calls; empty for a policy that keeps no log of them.
        plan_time_median_s: of the planning calls [s].
        plan_time_p99_s: of the planning calls [s].
        plan_time_max_s: of the planning calls [s].
        decision_time_median_s: wall-clock time from world to action, without simulation, in the
            steps in which something was decided [s]: making the observation, if the policy asks
            for one, and the policy's own call.
        decision_time_mean_s: the same, over all steps [s].
        decision_time_max_s: the slowest step [s].
    """

    policy: str
    task: str
    simulator: str
    scenario: str
    seed: int
    status: str
    reason: str
    success: bool
    E_nav: float | None = None
    I_nav: float | None = None
    S_manip: float | None = None
    E_manip: float | None = None
    I_manip: float | None = None
    path_length_m: float | None = None
    interaction_work_kg_m: float | None = None
    steps: int | None = None
    sim_time_s: float | None = None
    wall_time_s: float | None = None
    plan_calls: int | None = None
    plan_time_median_s: float | None = None
    plan_time_p99_s: float | None = None
    plan_time_max_s: float | None = None
    decision_time_median_s: float | None = None
    decision_time_mean_s: float | None = None
    decision_time_max_s: float | None = None

    @property
    def setting(self) -> str:
        """The scenario without its seed: what episodes are averaged over."""
        return setting_of(self.scenario, self.seed)

    @property
    def failed(self) -> bool:
        """Whether the job ended otherwise than by the rules of its task."""
        return self.status != Status.DONE


COLUMNS = tuple(field.name for field in fields(ResultRow))
TIMING_COLUMNS = tuple(
    name for name in COLUMNS if name.startswith(("wall_time", "plan_time", "decision_time"))
)
"""Columns that differ from run to run."""

SCORES = ("E_nav", "I_nav", "S_manip", "E_manip", "I_manip")
_SCORED = (*SCORES, "path_length_m", "interaction_work_kg_m", "steps", "sim_time_s")
_SCORED_NAMES = tuple(name for name in _SCORED if name in metric_names())
_COUNTED = ("steps", "sim_time_s")
_ZEROED = {
    "maze": ("E_nav",),
    "ship_ice": ("E_nav",),
    "box_delivery": ("S_manip", "E_manip"),
    "area_clearing": ("S_manip", "E_manip"),
}
"""Scores that are 0, and not missing, for a job that failed; else failures would raise the mean."""


def setting_of(scenario: str, seed: int) -> str:
    """The key of a scenario without its seed."""
    return scenario.removesuffix(f"-{seed}")


def blank_row(policy: str, scenario: Any, status: Status, reason: str) -> ResultRow:
    """The row of a job of which nothing was recorded."""
    zeroed: dict[str, Any] = dict.fromkeys(_ZEROED.get(str(scenario.task), ()), 0.0)
    return ResultRow(
        policy=policy,
        task=str(scenario.task),
        simulator=str(scenario.simulator),
        scenario=str(scenario.key),
        seed=int(scenario.seed),
        status=str(status),
        reason=reason,
        success=False,
        **zeroed,
    )


def scored_row(row: ResultRow, episode: Episode, plan_calls: int | None) -> ResultRow:
    """``row`` with everything that a recorded episode says.

    Args:
        row: who ran what, and how it ended.
        episode: what was recorded, up to the failure if there was one.
        plan_calls: how many planning calls the policy logged; None if it keeps no log.
    """
    # what a policy did until it failed says nothing about its scores
    names = _COUNTED if row.failed else _SCORED_NAMES
    values: dict[str, Any] = dict(compute(episode, names))
    if "steps" in values:
        values["steps"] = int(values["steps"])
    success = episode.success and not row.failed
    times = {**_plan_times(episode, plan_calls), **_decision_times(episode)}
    return replace(row, success=success, **values, **times)


def _plan_times(episode: Episode, plan_calls: int | None) -> Mapping[str, Any]:
    times = episode.plan_times_s
    if plan_calls is None or len(times) == 0:
        return {"plan_calls": plan_calls}
    return {
        "plan_calls": plan_calls,
        "plan_time_median_s": float(np.median(times)),
        "plan_time_p99_s": float(np.percentile(times, 99.0)),
        "plan_time_max_s": float(times.max()),
    }


def _decision_times(episode: Episode) -> Mapping[str, float]:
    times = episode.act_times_s
    if len(times) == 0:
        return {}
    return {
        "decision_time_median_s": float(np.median(times[:: episode.about.get("held_for", 1)])),
        "decision_time_mean_s": float(times.mean()),
        "decision_time_max_s": float(times.max()),
    }
