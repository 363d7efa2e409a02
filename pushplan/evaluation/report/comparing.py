"""Two runs beside each other, as a gate for continuous integration."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.errors import describe, short
from pushplan.evaluation.report.tables import Table
from pushplan.evaluation.statistics.estimates import ENOUGH, estimate, pairs_needed
from pushplan.evaluation.statistics.summary import by_scenario, grouped
from pushplan.evaluation.store.rows import (
    ResultRow,
    column_type,
    columns,
    csv_lines,
    row_from_texts,
)
from pushplan.evaluation.store.run_directory import open_results
from pushplan.world import InvalidInputError, SchemaError, UnknownNameError

SHORT = {
    "plan_time": "plan_time_median_s",
    "decision_time": "decision_time_median_s",
    "wall_time": "wall_time_s",
}
"""Further names of columns in rules."""
_RULE = re.compile(r"\s*(\w+)\s*([<>])\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*(%?)\s*")
NOTE = (
    "change is new minus old, scenario by scenario where both ran it, else between the means, with "
    "its 95 % interval; regressed: the whole interval is beyond the rule's bound; ok: no part of "
    f"it; unclear: the bound is within, or there are fewer than {ENOUGH} scenarios and a difference"
    "; '3 of 5' scenarios: in the others the new run did not start, or a job of either failed"
)


@dataclass(frozen=True)
class Rule:
    """Criterion for a regression of a column.

    Attributes:
        metric: the column.
        above: a change above the bound is one; else a change below it.
        bound: in the column's unit, or a fraction of the old mean if ``relative``.
        relative: see there.
    """

    metric: str
    above: bool
    bound: float
    relative: bool

    def __str__(self) -> str:
        bound = f"{self.bound:+g}"
        if self.relative:
            bound = f"{100.0 * self.bound:+g}%"
        return f"{self.metric}{'>' if self.above else '<'}{bound}"


@dataclass(frozen=True)
class Verdict:
    """Verdict of a rule on one policy in one setting.

    Attributes:
        rule: the rule.
        policy: label.
        setting: the scenarios without their seeds.
        count: scenarios compared; of the smaller run where they are not paired.
        paired: both runs have these scenarios.
        old: mean before.
        new: mean now; NaN if the new run has no such values.
        change: new minus old, divided by the old mean for a relative rule.
        low: lower end of its 95 % interval; minus infinity for one scenario that changed.
        high: upper end; infinity for one scenario that changed.
        verdict: ``"ok"``, ``"regressed"``, ``"unclear"`` or ``"missing"``.
        needed: scenarios that would separate the two, if it is unclear and a number would.
        known: scenarios that the policy ran in the setting of the old run.
    """

    rule: Rule
    policy: str
    setting: str
    count: int
    paired: bool
    old: float
    new: float
    change: float
    low: float
    high: float
    verdict: str
    needed: int | None = None
    known: int = 0

    @property
    def failed(self) -> bool:
        """True if the gate has to fail."""
        return self.verdict in ("regressed", "missing")


def read_rules(text: str) -> list[Rule]:
    """Rules as ``"S_manip<-0.01,plan_time>+20%"``: a column, a direction, a bound of the change.

    Raises:
        InvalidInputError: if a rule has another form.
        UnknownNameError: if there is no such column.
    """
    rules = []
    numbers = [name for name in columns() if column_type(name) != "str" and name != "seed"]
    for part in text.split(","):
        if (found := _RULE.fullmatch(part)) is None:
            raise InvalidInputError(
                f"a rule is a column, < or >, and a number, such as 'E_nav<-0.02' or "
                f"'plan_time>+20%', got {short(part)}"
            )
        name, direction, bound, percent = found.groups()
        metric = SHORT.get(name, name)
        if metric not in numbers:
            raise UnknownNameError("column", name, [*numbers, *SHORT])
        value = float(bound)
        if not math.isfinite(value):
            raise InvalidInputError(f"{bound!r} in rule {short(part)} is no finite number")
        unit = 100.0 if percent else 1.0
        rules.append(Rule(metric, direction == ">", value / unit, bool(percent)))
    return rules


def compare_runs(old: str | Path, new: str | Path, rules: str | Sequence[Rule]) -> list[Verdict]:
    """Judge the change from one run to another by rules, with the noise in mind.

    Scenarios that both runs have are compared one by one; where there are none of a policy, the
    means of its settings are compared, with Welch's interval.

    Args:
        old: run directory, or its ``results.csv``.
        new: the same.
        rules: see `read_rules`.

    Returns:
        A verdict for each rule, policy and setting of the old run that has values.

    Raises:
        InvalidInputError: if a run cannot be read, or nothing can be compared.
        UnknownNameError: if there is no such column.
    """
    chosen = read_rules(rules) if isinstance(rules, str) else rules
    before = grouped(_read(old))
    after = grouped(_read(new))
    found = []
    for (setting, policy), rows in before.items():
        for rule in chosen:
            one = by_scenario(rows, rule.metric)
            two = by_scenario(after.get((setting, policy), []), rule.metric)
            if one:
                judged = _judge(rule, policy, setting, one, two)
                found.append(replace(judged, known=len(rows)))
    if not found:
        names = ", ".join(sorted({rule.metric for rule in chosen}))
        raise InvalidInputError(f"{old} has no values of {names}: nothing can be compared")
    return found


def verdict_table(verdicts: Sequence[Verdict]) -> Table:
    """The verdicts as a table."""
    cells = []
    for one in verdicts:
        scale, unit = (100.0, " %") if one.rule.relative else (1.0, "")
        change = ""
        if not math.isnan(one.change):
            change = f"{scale * one.change:+.3g}{unit}"
            if one.count > 1:
                change += f"\n[{scale * one.low:+.3g}, {scale * one.high:+.3g}]"
        more = f"\n{one.needed} needed" if one.needed else ""
        count = f"{one.count}"
        if one.count != one.known:
            count += f" of {one.known}"
        count += "" if one.paired else "\nnot paired"
        means = [f"{value:.4g}" for value in (one.old, one.new)]
        cells.append((str(one.rule), one.policy, *means, change, count, one.verdict + more))
    headings = ("rule", "policy", "old", "new", "change", "scenarios", "verdict")
    return Table("New run beside the old one", headings, tuple(cells), NOTE)


def _judge(
    rule: Rule, policy: str, setting: str, one: Mapping[Any, float], two: Mapping[Any, float]
) -> Verdict:
    common = sorted(one.keys() & two.keys())
    paired = bool(common)
    if paired:
        one = {key: one[key] for key in common}
        two = {key: two[key] for key in common}
    old = np.array(list(one.values()))
    new = np.array(list(two.values()))
    count = min(len(old), len(new))
    if count == 0:
        nan = math.nan
        mean = float(old.mean())
        return Verdict(rule, policy, setting, 0, False, mean, nan, nan, nan, nan, "missing")
    unit = abs(float(old.mean())) if rule.relative else 1.0
    gaps = (new - old if paired else np.array([new.mean() - old.mean()])) / (unit or 1.0)
    change = float(gaps.mean())
    if paired and count > 1:
        found = estimate(gaps)
        low = found.low
        high = found.high
    elif (paired and change == 0.0) or (count > 1 and np.ptp(old) == np.ptp(new) == 0.0):
        low = change
        high = change
    elif count < 2:
        low = -math.inf
        high = math.inf
    else:
        from scipy import stats

        welch = stats.ttest_ind(new, old, equal_var=False).confidence_interval()
        low = float(welch.low) / (unit or 1.0)
        high = float(welch.high) / (unit or 1.0)
    sign = 1.0 if rule.above else -1.0
    best, worst = sorted((sign * low, sign * high))
    bound = sign * rule.bound
    # few scenarios condemn nothing, unless there is no change at all in any of them
    may_condemn = count >= ENOUGH or low == high == 0.0
    verdict = "unclear"
    if best > bound and may_condemn:
        verdict = "regressed"
    elif worst <= bound:
        verdict = "ok"
    needed = None
    if verdict == "unclear" and paired:
        needed = pairs_needed(gaps - rule.bound)
    means = float(old.mean()), float(new.mean())
    return Verdict(
        rule, policy, setting, count, paired, *means, change, low, high, verdict, needed
    )  # fmt: skip


def _read(path: str | Path) -> list[ResultRow]:
    path = Path(path)
    if path.suffix != ".csv":
        return open_results(path)[0]
    try:
        return [row_from_texts(line) for line in csv_lines(path)]
    except SchemaError:
        raise
    except (csv.Error, KeyError, TypeError, ValueError) as error:
        raise SchemaError(f"{path} is no results.csv: {describe(error)}") from error
