"""Tables of a run as plain data."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pushplan.evaluation.statistics.aggregates import (
    Aggregate,
    interquartile_mean,
    probability_of_improvement,
)
from pushplan.evaluation.statistics.estimates import Estimate, Proportion
from pushplan.evaluation.statistics.gaps import Gap
from pushplan.evaluation.statistics.summary import (
    PairedDifference,
    PolicySummary,
    grouped,
    settings_of,
    summarise,
    values_of,
)
from pushplan.evaluation.store.rows import ResultRow
from pushplan.metrics import METRICS, Role, metric_names
from pushplan.world.checks import FloatArray

_TIMING_HEADINGS = {
    "plan_time_median_s": "plan [ms]",
    "decision_time_median_s": "step [ms]",
    "wall_time_s": "wall [s]",
}
_TIMES = {
    "plan_time_median_s": "plan_time_max_s",
    "decision_time_median_s": "decision_time_max_s",
}


_PAIR_HEADINGS: tuple[str, ...] = (
    *("metric", "pair", "difference", "95 % interval"),
    *("better / worse / of", "p", "effect", "more"),
)
MANY_PAIRS = 12
"""From more lines on, a table of differences has one for each pair of policies."""
MANY_POLICIES = 6
"""From more rows on, a table for a screen has each on one line."""


@dataclass(frozen=True)
class Table:
    """A table of texts. A line break in a cell separates a value from its interval."""

    title: str  # one line
    headings: tuple[str, ...]  # one a column
    cells: tuple[tuple[str, ...], ...]  # rows of as many texts
    note: str = ""  # meaning of the numbers


SCORE_NOTE = (
    "mean ± standard deviation over episodes, 95 % bootstrap interval of the mean below; success "
    "with its Wilson interval; path and work include episodes that ended early, without success; "
    "plan is the median over episodes of each episode's median planning call, its slowest call "
    "below; step is the same for the time from world to action, without simulation"
)
RUNS_NOTE = (
    "n: runs behind a value, if not all; runs '3 of 5': the policy does not fit 2 starts of the "
    "table, was not asked for there, or has to run there yet; a failed run has no success and "
    "E_nav, E_manip, S_manip = 0, but no I_nav, I_manip, path, work, wall time and further "
    "metrics: these are of the other runs and may look better for it; runs of one world file that "
    "all drive alike are one"
)
_FEWER = re.compile(r"\nn = |^\d+ (of \d+|failed)$", re.MULTILINE)
MEASURED_NOTE = (
    "mean ± standard deviation over episodes, 95 % bootstrap interval of the mean below; med is "
    "the median"
)
PAIR_NOTE = (
    "second policy minus first on the same scenarios, I_nav and I_manip only where neither failed, "
    "path and work only where both succeed: mean, 95 % bootstrap interval; better and worse count "
    "the scenarios in which the second policy has the better or worse value, by the metric's own "
    "direction; p is of the signed-rank test (sign test for success), corrected by Holm over the "
    "pairs and settings of a metric; effect is the rank-biserial correlation, 1 where the second "
    "is better every time; * where p < 0.05 with 10 scenarios at least; more is the number of "
    "further scenarios for a power of 0.8 if the observed differences hold"
)
BRIEF_NOTE = (
    "second policy minus first on the same {} scenarios: mean, 95 % bootstrap interval; * where p "
    "< 0.05, corrected by Holm, with 10 scenarios at least; 'differences.csv' has the rest"
)
_APART_NOTE = (
    "mean and test point in different directions in {}: few large differences outweigh many small "
    "ones in the mean, and the test goes by ranks"
)
GAP_NOTE = (
    "work of robot and objects, m₀ l₀ + Σ mᵢ lᵢ, of the successful episodes: mean of how much it "
    "is above the best known solution of the scenario, and above a proven bound ('pushplan "
    "bounds'); of how many scenarios that is known"
)
AGGREGATE_NOTE = (
    "interquartile mean over all episodes of all settings with its 95 % stratified bootstrap "
    "interval; P is the probability that an episode of the policy has a better value than one of "
    "{first} in the same setting, ties one half (Agarwal et al., 2021)"
)


def heading(column: str) -> str:
    """The heading of a column in tables, with its unit."""
    if column in METRICS:
        return METRICS[column].heading or column
    return _TIMING_HEADINGS[column]


def score_tables(
    summaries: Sequence[PolicySummary], titles: dict[str, str], *, wide: bool = False
) -> list[Table]:
    """One table a setting with a row for each policy.

    Args:
        summaries: of a run.
        titles: text for each setting.
        wide: with medians and further columns, for files and pages.
    """
    tables = []
    for setting in dict.fromkeys(s.setting for s in summaries):
        mine = [s for s in summaries if s.setting == setting]
        shown = [*metric_names(Role.SCORE), *_TIMES]
        if wide:
            shown = [*metric_names(Role.SCORE, Role.DETAIL), "wall_time_s", *_TIMES]
        metrics = [name for name in shown if any(name in s.metrics for s in mine)]
        headings = ("policy", "runs", "success", *(heading(name) for name in metrics))
        cells = []
        for summary in mine:
            runs = f"{summary.episodes}"
            if summary.missing:
                runs += f" of {summary.episodes + summary.missing}"
            if summary.failed:
                runs += f"\n{summary.failed} failed"
            rate = summary.success
            success = f"{rate.fraction:.2f}{_interval(rate, 2)}"
            success += of_runs(rate.count, summary.episodes)
            values = (_score(summary, name, wide=wide) for name in metrics)
            cells.append((summary.policy, runs, success, *values))
        note = SCORE_NOTE + ("; med is the median" if wide else "")
        tables.append(_noted(Table(titles.get(setting, setting), headings, tuple(cells), note)))
    return tables


def of_runs(count: int, runs: int) -> str:
    """A line of a cell with the number of runs behind it, if that is not the usual one."""
    return "" if count == runs else f"\nn = {count}"


def _noted(table: Table) -> Table:
    """The table, with `RUNS_NOTE` if runs failed or a cell has a number of runs of its own."""
    if any(_FEWER.search(cell) for row in table.cells for cell in row):
        table = replace(table, note=f"{table.note}; {RUNS_NOTE}")
    return table


def _score(summary: PolicySummary, name: str, *, wide: bool) -> str:
    """The cell of a metric; of times the median and the longest, since their means say little."""
    value = summary.metrics.get(name)
    if value is None:
        return ""
    if name not in _TIMES:
        return _estimate(value, _digits(name), summary.episodes, wide=wide)
    text = milliseconds(value.median)
    longest = summary.metrics.get(_TIMES[name])
    if longest is not None:
        text += f"\nmax {milliseconds(longest.highest)}"
    return text + of_runs(value.count, summary.episodes)


def gap_tables(found: Sequence[Gap], titles: Mapping[str, str]) -> list[Table]:
    """One table a setting of how far its policies are from what is known to be possible."""
    tables = []
    for setting in dict.fromkeys(gap.setting for gap in found):
        cells = []
        for gap in (one for one in found if one.setting == setting):
            best = f"{gap.to_best:+.1%}" if gap.with_best else ""
            bound = f"{gap.to_bound:+.1%}"
            cells.append((gap.policy, best, f"{gap.with_best}", bound, f"{gap.count}"))
        headings = ("policy", "above best known", "of", "above bound", "of")
        tables.append(Table(titles.get(setting, setting), headings, tuple(cells), GAP_NOTE))
    return tables


def measured_tables(
    rows: Sequence[ResultRow],
    measured: Mapping[str, Mapping[str, float]],
    metrics: Sequence[str],
    policies: Sequence[str],
    titles: Mapping[str, str],
) -> list[Table]:
    """One table a setting of metrics that were computed from stored episodes.

    Args:
        rows: of a run.
        measured: job -> value by name of a metric.
        metrics: columns, in order.
        policies: rows, in order.
        titles: text for each setting, in order.
    """
    scored = [replace(row, metrics={**row.metrics, **measured.get(row.job, {})}) for row in rows]
    found = summarise(scored, policies, metrics)
    tables = []
    for setting, title in titles.items():
        mine = [one for one in found if one.setting == setting and one.metrics]
        cells = [(one.policy, *(_score(one, name, wide=True) for name in metrics)) for one in mine]
        tables.append(_noted(Table(title, ("policy", *metrics), tuple(cells), MEASURED_NOTE)))
    return tables if any(table.cells for table in tables) else []


def difference_tables(
    pairs: Sequence[PairedDifference], titles: dict[str, str], *, wide: bool = False
) -> list[Table]:
    """One table a setting with a row for each pair of policies and metric."""
    tables = []
    if not wide:
        pairs = [p for p in pairs if METRICS[p.metric].role is not Role.DETAIL]
    for setting in dict.fromkeys(pair.setting for pair in pairs):
        mine = [pair for pair in pairs if pair.setting == setting]
        metrics = list(dict.fromkeys(pair.metric for pair in mine))
        most = max(pair.difference.count for pair in mine)
        cells: list[tuple[str, ...]] = []
        brief: dict[str, list[str]] = {}
        for pair in mine:
            names = f"{pair.second} - {pair.first}"
            digits = _digits(pair.metric)
            mean = f"{pair.difference.mean:+.{digits}f}"
            interval = _interval(pair.difference, digits, "+").lstrip()
            star = " *" if pair.significant else ""
            count = pair.difference.count
            line = brief.setdefault(names, [""] * len(metrics))
            shown = f"{mean} {interval}".rstrip() + star
            line[metrics.index(pair.metric)] = shown + of_runs(count, most)
            p_value = f"{pair.p_corrected:.3f}"
            if pair.p_corrected < 0.001:
                p_value = "< 0.001"
            wins = f"{pair.better} / {pair.worse} / {count}"
            tested = wins, p_value, f"{pair.effect:+.2f}", _more(pair)
            cells.append((heading(pair.metric), names, mean + star, interval, *tested))
        headings = _PAIR_HEADINGS
        note = PAIR_NOTE
        if not wide and len(cells) > MANY_PAIRS:
            cells = [(names, *line) for names, line in brief.items()]
            headings = ("pair", *map(heading, metrics))
            note = BRIEF_NOTE.format(most)
        if apart := [pair for pair in mine if pair.significant and _is_mean_apart(pair)]:
            named = (f"{heading(p.metric)} of {p.second} - {p.first}" for p in apart)
            note = f"{note}; {_APART_NOTE.format(', '.join(named))}"
        title = f"Paired differences: {titles.get(setting, setting)}"
        tables.append(_noted(Table(title, headings, tuple(cells), note)))
    return tables


def on_few_lines(tables: Sequence[Table]) -> list[Table]:
    """The tables with a line for each row, where there are many."""
    found = []
    for table in tables:
        if len(table.cells) > MANY_POLICIES:
            cells = (tuple(text.replace("\n", " ") for text in row) for row in table.cells)
            table = replace(table, cells=tuple(cells))
        found.append(table)
    return found


def _is_mean_apart(pair: PairedDifference) -> bool:
    """True if the mean difference says better where the test says worse, or the other way round."""
    sign = 1.0 if METRICS[pair.metric].higher_is_better else -1.0
    return sign * pair.difference.mean * pair.effect < 0.0


def _more(pair: PairedDifference) -> str:
    """Further scenarios that the pair needs."""
    if pair.significant:
        return ""
    if pair.needed is None:
        return "-"
    more = max(pair.needed - pair.difference.count, 1)
    return f"{more}" if more <= 10_000 else "> 10000"


def aggregate_table(rows: Sequence[ResultRow], policies: Sequence[str]) -> Table | None:
    """Scores over all settings, one row for each policy that has a score in every one.

    Args:
        rows: of a run.
        policies: labels in order; improvement is over the first of them.

    Returns:
        None if there is nothing to compare or only one setting.
    """
    groups = grouped(rows)
    settings = settings_of(rows)
    if len(settings) < 2:
        return None
    strata: dict[tuple[str, str], list[FloatArray]] = {}
    for name, label in itertools.product(metric_names(Role.SCORE), policies):
        values = [values_of(groups.get((setting, label), []), name) for setting in settings]
        if all(values):
            strata[label, name] = [np.array(found) for found in values]
    shown = list(dict.fromkeys(name for _, name in strata))
    if not shown:
        return None
    first = policies[0]
    headings = ["policy"]
    for name in shown:
        headings += [heading(name), f"P({name})"]
    starts = len({(row.scenario, row.seed) for row in rows})

    def cell(found: Aggregate, digits: int, *samples: list[FloatArray]) -> str:
        count = min(sum(map(len, sample)) for sample in samples)
        return f"{found.value:.{digits}f}{_interval(found, digits)}{of_runs(count, starts)}"

    cells = []
    for label in policies:
        line = [label]
        for name in shown:
            mine = strata.get((label, name))
            base = strata.get((first, name))
            line += [cell(interquartile_mean(mine), 3, mine) if mine else "", ""]
            if mine and base and label != first:
                line[-1] = cell(probability_of_improvement(mine, base), 2, mine, base)
        if any(line[1:]):
            cells.append(tuple(line))
    title = f"Interquartile means of all {len(settings)} settings"
    note = AGGREGATE_NOTE.format(first=first)
    return _noted(Table(title, tuple(headings), tuple(cells), note))


def _digits(column: str) -> int:
    return METRICS[column].digits if column in METRICS else 3


def _estimate(value: Estimate, digits: int, runs: int, *, wide: bool = True) -> str:
    text = f"{value.mean:.{digits}f}"
    if value.count > 1:
        text += f" ± {value.sd:.{digits}f}{_interval(value, digits)}"
        text += f"\nmed {value.median:.{digits}f}" if wide else ""
    return text + of_runs(value.count, runs)


def _interval(value: Estimate | Aggregate | Proportion, digits: int, sign: str = "") -> str:
    """A line with the interval; empty if there is none."""
    if math.isnan(value.low):
        return ""
    return f"\n[{value.low:{sign}.{digits}f}, {value.high:{sign}.{digits}f}]"


def milliseconds(seconds: float) -> str:
    """A time in milliseconds, as tables show it."""
    value = 1e3 * seconds
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"
