"""What the rows of a run say about each policy, and about each pair of policies."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.evaluation.rows import ResultRow
from pushplan.evaluation.statistics import Estimate, Proportion, estimate, wilson
from pushplan.metrics import METRICS, Role, metric_names

TIMINGS = (
    "plan_time_median_s",
    "plan_time_max_s",
    "decision_time_median_s",
    "decision_time_mean_s",
    "decision_time_max_s",
    "wall_time_s",
)


@dataclass(frozen=True)
class PolicySummary:
    """One policy in one setting.

    Attributes:
        setting: the scenarios without their seeds.
        policy: label.
        episodes: number of rows.
        failed: rows that did not end by the rules of the task.
        success: fraction of successes; failed rows count as none.
        metrics: estimate of each column that has values.
    """

    setting: str
    policy: str
    episodes: int
    failed: int
    success: Proportion
    metrics: dict[str, Estimate]


@dataclass(frozen=True)
class PairedDifference:
    """How much more of a metric the second policy has than the first, scenario by scenario.

    Attributes:
        setting: the scenarios without their seeds.
        metric: column.
        first: label of one policy.
        second: label of the other.
        difference: of second minus first, over the scenarios where both have a value.
        wins: scenarios in which the second has the better value; the greater one of a metric of
            which neither is better.
        losses: scenarios in which it has the worse one.
    """

    setting: str
    metric: str
    first: str
    second: str
    difference: Estimate
    wins: int
    losses: int

    @property
    def clear(self) -> bool:
        """Whether the 95 % interval of the difference leaves out 0."""
        return self.difference.low > 0.0 or self.difference.high < 0.0


def summarise(rows: Sequence[ResultRow], order: Sequence[str] = ()) -> list[PolicySummary]:
    """One summary for each setting and policy.

    Args:
        rows: of a run.
        order: labels in the order in which policies are shown; others follow by name.
    """
    summaries = []
    for setting in settings_of(rows):
        for policy in policies_of(rows, order):
            mine = [r for r in rows if r.policy == policy and r.setting == setting]
            if mine:
                summaries.append(_summary(setting, policy, mine))
    return summaries


def paired_differences(
    rows: Sequence[ResultRow], order: Sequence[str] = ()
) -> list[PairedDifference]:
    """Every pair of policies on the scenarios that both ran, for each score and for the work."""
    labels = policies_of(rows, order)
    pairs = [(a, b) for i, a in enumerate(labels) for b in labels[i + 1 :]]
    found = [
        _pair(setting, metric, first, second, rows)
        for setting in settings_of(rows)
        for metric in metric_names(Role.SCORE, Role.DETAIL)
        for first, second in pairs
    ]
    return [pair for pair in found if pair is not None]


def policies_of(rows: Sequence[ResultRow], order: Sequence[str] = ()) -> list[str]:
    """Labels of the policies: in the given order, then by name."""
    present = {row.policy for row in rows}
    return [label for label in order if label in present] + sorted(present - set(order))


def values_of(rows: Sequence[ResultRow], metric: str) -> list[float]:
    """The values of a column, without empty fields."""
    return [float(v) for row in rows if (v := getattr(row, metric)) is not None]


def _summary(setting: str, policy: str, rows: Sequence[ResultRow]) -> PolicySummary:
    shown = metric_names(Role.SCORE, Role.DETAIL, Role.FACT)
    columns = {name: values_of(rows, name) for name in (*shown, *TIMINGS)}
    return PolicySummary(
        setting=setting,
        policy=policy,
        episodes=len(rows),
        failed=sum(row.failed for row in rows),
        success=wilson(sum(row.success for row in rows), len(rows)),
        metrics={name: estimate(values) for name, values in columns.items() if values},
    )


def _pair(
    setting: str, metric: str, first: str, second: str, rows: Sequence[ResultRow]
) -> PairedDifference | None:
    def by_scenario(label: str) -> dict[tuple[str, int], float]:
        return {
            (row.scenario, row.seed): float(value)
            for row in rows
            if row.policy == label and row.setting == setting
            if (value := getattr(row, metric)) is not None
        }

    one, two = by_scenario(first), by_scenario(second)
    common = sorted(one.keys() & two.keys())
    if not common:
        return None
    better = -1.0 if METRICS[metric].higher_is_better is False else 1.0
    gaps = np.array([two[key] - one[key] for key in common])
    return PairedDifference(
        setting=setting,
        metric=metric,
        first=first,
        second=second,
        difference=estimate(gaps),
        wins=int((better * gaps > 0.0).sum()),
        losses=int((better * gaps < 0.0).sum()),
    )


def settings_of(rows: Sequence[ResultRow]) -> list[str]:
    """The settings that occur, with numbers in their order."""
    seen = {row.setting: None for row in sorted(rows, key=_natural)}
    return list(seen)


def _natural(row: ResultRow) -> list[object]:
    parts = re.split(r"(\d+)", row.setting)
    return [(0, int(p), "") if p.isdigit() else (1, 0, p) for p in parts]
