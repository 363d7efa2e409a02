"""Statistics of each policy of a run, and of each pair of policies."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.evaluation.statistics.estimates import (
    ENOUGH,
    LEVEL,
    Estimate,
    Proportion,
    estimate,
    holm,
    pairs_needed,
    signed_rank_test,
    wilson,
)
from pushplan.evaluation.store.rows import ResultRow
from pushplan.metrics import METRICS, Role, metric_names
from pushplan.world.checks import FloatArray, choice

PAIRS = ("first", "all")
"""Policies that are compared: the first one with each other one, or all."""
TIMINGS = (
    "plan_time_median_s",
    "plan_time_max_s",
    "decision_time_median_s",
    "decision_time_mean_s",
    "decision_time_max_s",
    "wall_time_s",
)
SUMMARISED = (*metric_names(Role.SCORE, Role.DETAIL, Role.FACT), *TIMINGS)
_WORLDS = "room"
"""Task of the worlds of files."""
_SUMS = ("wall_time_s", "plan_calls", *(name for name, one in METRICS.items() if one.until_failure))
"""Columns that are smaller for a run that failed early."""


@dataclass(frozen=True)
class PolicySummary:
    """One policy in one setting.

    Attributes:
        setting: the suite, or the scenarios without their seeds.
        policy: label.
        episodes: number of rows.
        failed: rows that did not end by the rules of the task.
        missing: starts that other policies ran in the setting and this one did not.
        success: fraction of successes; failed rows count as none.
        metrics: estimate of each column that has values, see `values_of`.
    """

    setting: str
    policy: str
    episodes: int
    failed: int
    missing: int
    success: Proportion
    metrics: dict[str, Estimate]


@dataclass(frozen=True)
class PairedDifference:
    """Difference of a metric between the second policy and the first, scenario by scenario.

    Attributes:
        setting: the suite, or the scenarios without their seeds.
        metric: column.
        first: label of one policy.
        second: label of the other.
        difference: of second minus first, over the scenarios where both have a value.
        better: scenarios in which the second has the better value, by the metric's direction.
        worse: scenarios in which it has the worse one.
        p_value: of `signed_rank_test`.
        p_corrected: by `holm`, over the pairs and settings compared of the metric.
        effect: rank-biserial correlation in [-1, 1], 1 where the second is better every time.
        needed: scenarios with which the pair is separated, see `pairs_needed`; None if no number
            does.
    """

    setting: str
    metric: str
    first: str
    second: str
    difference: Estimate
    better: int
    worse: int
    p_value: float
    p_corrected: float
    effect: float
    needed: int | None

    @property
    def significant(self) -> bool:
        """True if the corrected p value is below 0.05, with 10 scenarios at least."""
        return self.difference.count >= ENOUGH and self.p_corrected < LEVEL

    @property
    def verdict(self) -> str:
        """Verdict on the second policy: "better", "worse", "equal" or "not separated"."""
        if self.better == self.worse == 0:
            return "equal"
        if not self.significant:
            return "not separated"
        return "better" if self.effect > 0.0 else "worse"


def summarise(
    rows: Sequence[ResultRow], order: Sequence[str] = (), metrics: Sequence[str] = SUMMARISED
) -> list[PolicySummary]:
    """One summary for each setting and policy.

    Args:
        rows: of a run.
        order: labels in the order in which policies are shown; others follow by name.
        metrics: columns, or other names among the rows' metrics.
    """
    starts = Counter(key[0] for key in {(row.setting, row.scenario, row.seed) for row in rows})
    found = []
    for (setting, policy), mine in grouped(rows, order).items():
        columns = {name: values_of(mine, name) for name in metrics}
        successes = values_of(mine, "success")
        found.append(
            PolicySummary(
                setting=setting,
                policy=policy,
                episodes=len(mine),
                failed=sum(row.failed for row in mine),
                missing=max(0, starts[setting] - len(mine)),
                success=wilson(round(sum(successes)), len(successes)),
                metrics={name: estimate(values) for name, values in columns.items() if values},
            )
        )
    return found


def paired_differences(
    rows: Sequence[ResultRow], order: Sequence[str] = (), pairs: str = "first"
) -> list[PairedDifference]:
    """Pairs of policies on the scenarios that both ran, for success, scores and lengths.

    Metrics of which neither direction is better are left out. Path and work are compared where
    both succeed: who fails has driven and pushed less. Scenarios in which both drive just as in
    another run of the same world file, as without spread, count once.

    Args:
        rows: of a run.
        order: labels in the order of the policies; others follow by name.
        pairs: ``"first"`` for the first policy with each other one, or ``"all"``.
    """
    compared = list(itertools.combinations(policies_of(rows, order), 2))
    if choice("pairs", pairs, PAIRS) == "first":
        compared = [pair for pair in compared if pair[0] == compared[0][0]]
    groups = grouped(rows)
    settings = settings_of(rows)
    drives = {key: {(r.scenario, r.seed): _drive(r) for r in mine} for key, mine in groups.items()}
    found: list[PairedDifference] = []
    for metric in ("success", *metric_names(Role.SCORE, Role.DETAIL)):
        if (higher := METRICS[metric].higher_is_better) is None:
            continue
        every = METRICS[metric].role is not Role.DETAIL
        values = {
            key: by_scenario([row for row in mine if every or row.success], metric)
            for key, mine in groups.items()
        }
        gaps: dict[tuple[str, str, str], FloatArray] = {}
        for setting in settings:
            for first, second in compared:
                one = values.get((setting, first), {})
                two = values.get((setting, second), {})
                if common := sorted(one.keys() & two.keys()):
                    pairs_of = {
                        (drives[setting, first][k], drives[setting, second][k]): two[k] - one[k]
                        for k in common
                    }
                    gaps[setting, first, second] = np.array(list(pairs_of.values()))
        tested = [signed_rank_test(gap) for gap in gaps.values()]
        corrected = holm([p_value for p_value, _ in tested])
        sign = 1.0 if higher else -1.0
        for i, ((setting, first, second), gap) in enumerate(gaps.items()):
            found.append(
                PairedDifference(
                    setting=setting,
                    metric=metric,
                    first=first,
                    second=second,
                    difference=estimate(gap),
                    better=int((sign * gap > 0.0).sum()),
                    worse=int((sign * gap < 0.0).sum()),
                    p_value=tested[i][0],
                    p_corrected=corrected[i],
                    effect=sign * tested[i][1],
                    needed=pairs_needed(gap, len(tested)),
                )
            )
    return sorted(found, key=lambda pair: settings.index(pair.setting))


def grouped(
    rows: Sequence[ResultRow], order: Sequence[str] = ()
) -> dict[tuple[str, str], list[ResultRow]]:
    """The rows by setting and policy, in the order of `settings_of` and `policies_of`."""
    groups: dict[tuple[str, str], list[ResultRow]] = {}
    for row in rows:
        groups.setdefault((row.setting, row.policy), []).append(row)
    keys = itertools.product(settings_of(rows), policies_of(rows, order))
    return {key: groups[key] for key in keys if key in groups}


def policies_of(rows: Sequence[ResultRow], order: Sequence[str] = ()) -> list[str]:
    """Labels of the policies: in the given order, then by name."""
    present = {row.policy for row in rows}
    return [label for label in order if label in present] + sorted(present - set(order))


def values_of(rows: Sequence[ResultRow], metric: str) -> list[float]:
    """The values of a column in the rows of a policy.

    Empty fields are left out, and a failed run's sums up to its failure, such as its time. Runs of
    one world file that all drive alike are one run, except for what times they took.
    """
    found = [value for _, value in _valued(rows, metric)]
    if metric in TIMINGS or not rows or rows[0].task != _WORLDS:
        return found
    return found if len(set(map(_drive, rows))) > 1 else found[:1]


def _valued(rows: Sequence[ResultRow], metric: str) -> Iterator[tuple[ResultRow, float]]:
    for row in rows:
        value = row.metrics.get(metric, getattr(row, metric, None))
        if value is not None and not (row.failed and metric in _SUMS):
            yield row, float(value)


def _drive(row: ResultRow) -> object:
    """Value that is the same for two rows of a policy that drove alike in one world of a user.

    Elsewhere the seed decides the layout, and two drives through it may be alike by chance.
    """
    if row.failed or row.task != _WORLDS or row.metrics.get("path_length_m") is None:
        return (row.scenario, row.seed)
    return (row.scenario.removesuffix(f"-{row.seed}"), row.reason, *sorted(row.metrics.items()))


def by_scenario(rows: Sequence[ResultRow], metric: str) -> dict[tuple[str, int], float]:
    """Scenario and seed -> value of a column, without empty fields and sums up to a failure."""
    return {(row.scenario, row.seed): value for row, value in _valued(rows, metric)}


def settings_of(rows: Sequence[ResultRow]) -> list[str]:
    """The settings that occur, in the order of the rows."""
    return list(dict.fromkeys(row.setting for row in rows))


def natural(title: str) -> list[tuple[int, int, str]]:
    """Key that sorts texts with the numbers in them in their order."""
    parts = re.split(r"(\d+)", title)
    return [(0, int(p), "") if p.isdecimal() else (1, 0, p) for p in parts]
