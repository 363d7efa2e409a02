"""Stress test: a policy in a robot's loop, under one disturbance after another."""

from __future__ import annotations

import math
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.evaluation.benchmark import suites_of
from pushplan.evaluation.report.tables import Table, heading, of_runs
from pushplan.evaluation.run.batch import Progress, run_batch
from pushplan.evaluation.run.compatibility import misfits
from pushplan.evaluation.run.jobs import Job, JobSettings
from pushplan.evaluation.run.policy_specs import PolicySpec, parse_policy
from pushplan.evaluation.statistics.estimates import wilson
from pushplan.evaluation.store.rows import ResultRow
from pushplan.files.safe_files import read_data
from pushplan.metrics import Role, metric_names
from pushplan.runtime.disturbed_policy import Disturbances, DisturbedPolicy
from pushplan.scenarios.scenario import Variations
from pushplan.world import InvalidInputError, UnknownNameError
from pushplan.world.checks import number

UNDISTURBED = "undisturbed"


@dataclass(frozen=True)
class Condition:
    """Disturbances of a stress test, and the scores that a policy has to keep under them.

    Args:
        disturbances: of perception, prediction and actuators.
        rate: of the robot's loop [Hz]; that of the stress test if None.
        variations: of the scenario.
        success: fraction of episodes that has to succeed; None where nothing is asked for.
        kept: least part of the undisturbed efficiency and effort scores; 0 where nothing is asked.
        of_sensors: for scenarios in which the robot has sensors of its own; elsewhere it is only
            run where it is asked for by name.
    """

    disturbances: Disturbances = field(default_factory=Disturbances)
    rate: float | None = None
    variations: Mapping[str, Any] = field(default_factory=dict)
    success: float | None = 0.95
    kept: float = 0.0
    of_sensors: bool = False


def _standard_conditions() -> dict[str, Condition]:
    found = {}
    for name, one in read_data(Path(__file__).with_name("stress_conditions.yaml")).items():
        disturbances = Disturbances(**one.pop("disturbances", {}))
        found[name] = Condition(disturbances, **one)
    return found


CONDITIONS: Mapping[str, Condition] = _standard_conditions()
"""The standard conditions by name. Noise is that of every pose seen; what is lost comes in bursts
of four on average; "mass" is what the policy is told over what is true."""


@dataclass(frozen=True)
class StressRow:
    """Result of a policy under one condition.

    Attributes:
        condition: its name.
        episodes: how many there were.
        successes: how many reached the task's goal.
        ends: how the others ended: reason -> how many. What the task does not know is an episode
            that failed, such as one that took too long.
        scores: mean of each score that there is.
        kept: each score over that of the undisturbed episodes with the same seeds.
        missed: what was asked for and not reached, in words.
        counts: episodes behind the mean of each score: those that have it, as have the undisturbed
            ones with the same seeds. Failed ones have no I_nav and I_manip.
    """

    condition: str
    episodes: int
    successes: int
    ends: Mapping[str, int]
    scores: Mapping[str, float]
    kept: Mapping[str, float]
    missed: tuple[str, ...]
    counts: Mapping[str, int]


@dataclass(frozen=True)
class ScoreSheet:
    """A stress test: one row a condition."""

    policy: str
    suite: str
    rows: tuple[StressRow, ...]

    @property
    def missed(self) -> tuple[str, ...]:
        """Conditions in which something that was asked for was not reached."""
        return tuple(row.condition for row in self.rows if row.missed)

    def table(self) -> Table:
        """The sheet as a table."""
        names = list(dict.fromkeys(name for row in self.rows for name in row.scores))
        headings = ["condition", "success"]
        for name in names:
            headings += [heading(name), "kept"]
        cells = []
        for row in self.rows:
            rate = wilson(row.successes, row.episodes)
            line = [row.condition, f"{rate.fraction:.2f} [{rate.low:.2f}, {rate.high:.2f}]"]
            for name in names:
                of = of_runs(row.counts.get(name, 0), row.episodes)
                line.append(f"{row.scores[name]:.3f}{of}" if name in row.scores else "")
                line.append(f"{row.kept[name]:.2f}" if name in row.kept else "")
            ends = ", ".join(f"{count} {reason}" for reason, count in row.ends.items())
            cells.append((*line, ends, "; ".join(row.missed)))
        return Table(
            f"{self.policy} on {self.suite}, {self.rows[0].episodes} episodes a condition",
            (*headings, "without success", "missed"),
            tuple(cells),
            "success with its Wilson 95 % interval; kept is the mean over that of the undisturbed "
            "episodes with the same seeds; n: episodes with the score, if not all; failed ones "
            "have E = 0, but no I, which may look better for it",
        )


def stress(
    policy: str | Callable[..., Any] | PolicySpec,
    suite: Any,
    *,
    conditions: Sequence[str] | Mapping[str, Condition] | None = None,
    episodes: int = 20,
    seed: int = 0,
    rate: float = 20.0,
    planning_time: float = 0.05,
    workers: int | None = None,
    out: str | Path | None = None,
    timeout_s: float | None = 900.0,
    progress: Progress | None = None,
) -> ScoreSheet:
    """Drive a policy by `pushplan.runtime.Runner` under one disturbance after another.

    What is known of a robot that has been measured, its noise, also that of its sensors, and the
    lag of its actuators, is told to the runner. A planning call takes the same simulated time
    each, so the sheet repeats.

    Args:
        policy: a name, ``"module:Class"``, ``"file.py:Class"``, or a callable that makes one.
        suite: name of a suite, a `pushplan.scenarios.Suite`, or a list of scenarios.
        conditions: names of `CONDITIONS`, all by default, or conditions of your own by name.
            `UNDISTURBED` is always run too.
        episodes: scenarios of a suite by name.
        seed: of the first scenario of a suite by name.
        rate: of the robot's loop where a condition does not say [Hz].
        planning_time: what a planning call takes [s].
        workers: processes, all cores by default; 0 runs in this process.
        out: run directory, continued if it holds this test already.
        timeout_s: wall-clock limit of an episode [s].
        progress: told of every row.

    Raises:
        UnknownNameError: if there is no such policy, suite or condition.
        UnusablePolicyError: if the policy cannot run in any of the scenarios.
        ScenarioError: if a condition makes no sense in them, such as noise of sensors without any.
    """
    rate = number("rate", rate, low=0.0, open_low=True)
    (chosen,) = suites_of(suite, episodes, seed)
    name = chosen.name
    scenarios = chosen.scenarios
    if not scenarios:
        raise InvalidInputError("a stress test needs at least one scenario")
    sensed = all(one.variations.get("sensing", "full") != "full" for one in scenarios)
    wanted = _conditions(conditions, sensed)
    spec = parse_policy(policy)
    misfits([spec], [chosen], JobSettings())
    jobs = []
    for label, condition in wanted.items():
        period = 1.0 / (condition.rate or rate)
        changes = {**condition.variations, "control_step": period}
        for scenario in scenarios:
            variations = {**scenario.variations, **changes}
            noise = (0.0, 0.0)
            if variations.get("sensing", "full") != "full":
                noise = variations.get("object_noise", 0.0), variations.get("turn_noise", 0.0)
            make = partial(_disturbed, spec, condition.disturbances, period, planning_time, noise)
            varied = replace(scenario, variations=Variations(variations))
            jobs.append(Job(PolicySpec(label, make), varied))
    for job in {job.scene: job for job in jobs}.values():
        JobSettings().environment(job.scenario, None).close()
    jobs.sort(key=lambda job: job.key[2])  # a test that is cut short still compares conditions
    with tempfile.TemporaryDirectory(prefix="pushplan-") as temporary:
        rows = run_batch(
            jobs,
            out=temporary if out is None else out,
            workers=workers,
            settings=JobSettings(timeout_s=timeout_s),
            progress=progress,
        )
    found = {label: [row for row in rows if row.policy == label] for label in wanted}
    calm = {row.seed: row for row in found[UNDISTURBED]}
    judged = (_judged(label, one, found[label], calm) for label, one in wanted.items())
    return ScoreSheet(spec.label, name, tuple(judged))


def _disturbed(
    spec: PolicySpec,
    disturbances: Disturbances,
    period: float,
    planning_time: float,
    sensor_noise: tuple[float, float],
) -> DisturbedPolicy:
    return DisturbedPolicy(
        spec.make(),
        disturbances,
        period=period,
        planning_time=planning_time,
        position_noise=math.hypot(disturbances.position_noise, sensor_noise[0]),
        heading_noise=math.hypot(disturbances.heading_noise, sensor_noise[1]),
    )


def _conditions(
    given: Sequence[str] | Mapping[str, Condition] | None, sensed: bool
) -> dict[str, Condition]:
    if isinstance(given, Mapping):
        return {UNDISTURBED: CONDITIONS[UNDISTURBED], **given}
    if given is not None:
        for name in given:
            if name not in CONDITIONS:
                raise UnknownNameError("condition", name, CONDITIONS)
        return {name: CONDITIONS[name] for name in dict.fromkeys((UNDISTURBED, *given))}
    return {name: one for name, one in CONDITIONS.items() if sensed or not one.of_sensors}


def _judged(
    name: str, condition: Condition, rows: Sequence[ResultRow], calm: Mapping[int, ResultRow]
) -> StressRow:
    """The outcome of a condition; ``calm`` are the undisturbed episodes by their seeds."""
    scores = {}
    counts = {}
    kept = {}
    for score in metric_names(Role.SCORE):
        pairs = [(getattr(row, score), getattr(calm[row.seed], score)) for row in rows]
        pairs = [pair for pair in pairs if None not in pair]
        if pairs:
            counts[score] = len(pairs)
            scores[score], before = np.mean(pairs, axis=0).tolist()
            if before > 0.0:
                kept[score] = scores[score] / before
    ends = Counter(row.reason for row in rows if not row.success)
    successes = len(rows) - ends.total()
    missed = []
    if condition.success is not None and successes < condition.success * len(rows):
        missed.append(f"success ≥ {condition.success:g}")
    if ends["wall"] and condition.success is not None:
        missed.append("no wall")
    for score, part in kept.items():
        if part < condition.kept:
            missed.append(f"{score} kept ≥ {condition.kept:g}")
    listed = dict(ends.most_common())
    return StressRow(name, len(rows), successes, listed, scores, kept, tuple(missed), counts)
