"""Tables of a run as plain data, and as Markdown, CSV and text."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pushplan.evaluation.rows import csv_text
from pushplan.evaluation.statistics import Estimate
from pushplan.evaluation.summary import PairedDifference, PolicySummary
from pushplan.metrics import METRICS, Role, metric_names

if TYPE_CHECKING:
    from rich.table import Table as RichTable

_TIMING_HEADINGS = {
    "plan_time_median_s": "plan [ms]",
    "decision_time_median_s": "step [ms]",
    "wall_time_s": "wall [s]",
}
_TIMES = {
    "plan_time_median_s": "plan_time_max_s",
    "decision_time_median_s": "decision_time_max_s",
}


@dataclass(frozen=True)
class Table:
    """A table of texts. A line break in a cell separates a value from its interval."""

    title: str  # one line
    headings: tuple[str, ...]  # one a column
    cells: tuple[tuple[str, ...], ...]  # rows of as many texts
    note: str = ""  # what the numbers are


SCORE_NOTE = (
    "mean ± standard deviation over episodes, 95 % bootstrap interval of the mean below; success "
    "with its Wilson interval; a failed job counts as no success and E_nav = 0; plan is the "
    "median over episodes of each episode's median planning call, its slowest call below; step "
    "is the same for the time from world to action, without simulation"
)
MEASURED_NOTE = (
    "mean ± standard deviation over the episodes that did not fail, 95 % bootstrap interval of "
    "the mean below; med is the median"
)
PAIR_NOTE = (
    "same scenarios, second policy minus first: mean with 95 % bootstrap interval; * where the "
    "interval leaves out 0; wins are scenarios in which the second policy has the better value"
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
        shown = metric_names(Role.SCORE, Role.DETAIL) if wide else metric_names(Role.SCORE)
        shown = (*shown, *(("wall_time_s",) if wide else ()), *_TIMES)
        metrics = [name for name in shown if any(name in s.metrics for s in mine)]
        headings = ("policy", "runs", "success", *(heading(name) for name in metrics))
        cells = tuple(_policy_cells(summary, metrics, wide) for summary in mine)
        note = SCORE_NOTE + ("; med is the median" if wide else "")
        tables.append(Table(titles.get(setting, setting), headings, cells, note))
    return tables


def measured_tables(
    estimates: Mapping[tuple[str, str, str], Estimate],
    policies: Sequence[str],
    metrics: Sequence[str],
    titles: Mapping[str, str],
) -> list[Table]:
    """One table a setting of metrics that were computed from stored episodes.

    Args:
        estimates: (setting, policy, metric) -> estimate.
        policies: rows, in order.
        metrics: columns, in order.
        titles: text for each setting, in order.
    """
    tables = []
    for setting, title in titles.items():
        cells = []
        for policy in policies:
            found = [estimates.get((setting, policy, name)) for name in metrics]
            if any(found):
                cells.append(
                    (
                        policy,
                        *(_estimate(e, _digits(n)) for n, e in zip(metrics, found, strict=True)),
                    )
                )
        tables.append(Table(title, ("policy", *metrics), tuple(cells), MEASURED_NOTE))
    return tables


def difference_tables(
    pairs: Sequence[PairedDifference], titles: dict[str, str], *, wide: bool = False
) -> list[Table]:
    """One table a setting with a row for each pair of policies and metric."""
    tables = []
    if not wide:
        pairs = [pair for pair in pairs if METRICS[pair.metric].role is Role.SCORE]
    for setting in dict.fromkeys(pair.setting for pair in pairs):
        cells = tuple(
            (
                heading(pair.metric),
                f"{pair.second} - {pair.first}",
                _number(pair.difference.mean, _digits(pair.metric), sign=True)
                + (" *" if pair.clear else ""),
                _interval(pair.difference, _digits(pair.metric), sign=True),
                f"{pair.wins} / {pair.losses} / {pair.difference.count}",
            )
            for pair in pairs
            if pair.setting == setting
        )
        headings = ("metric", "pair", "difference", "95 % interval", "wins / losses / of")
        title = f"Paired differences: {titles.get(setting, setting)}"
        tables.append(Table(title, headings, cells, PAIR_NOTE))
    return tables


def markdown(tables: Sequence[Table]) -> str:
    """The tables as a Markdown document."""
    blocks = []
    for table in tables:
        lines = [f"## {table.title}", "", _line(table.headings)]
        lines.append(_line(["---"] * len(table.headings)))
        lines += [_line([cell.replace("\n", "<br>") for cell in row]) for row in table.cells]
        if table.note:
            lines += ["", f"{table.note[0].upper()}{table.note[1:]}."]
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks) + "\n"


def summary_csv(summaries: Sequence[PolicySummary], titles: dict[str, str]) -> str:
    """One line for each setting, policy and metric, with all digits."""
    lines: list[Sequence[object]] = []
    for summary in summaries:
        who = (titles.get(summary.setting, summary.setting), summary.policy)
        rate = summary.success
        lines.append((*who, "success", rate.count, rate.fraction, "", "", rate.low, rate.high))
        lines += [(*who, name, *_numbers(value)) for name, value in summary.metrics.items()]
    return csv_text("setting,policy,metric,count,mean,sd,median,low,high".split(","), lines)


def differences_csv(pairs: Sequence[PairedDifference], titles: dict[str, str]) -> str:
    """One line for each setting, metric and pair of policies, with all digits."""
    names = "setting,metric,first,second,count,mean,sd,median,low,high,wins,losses"
    lines = [
        (
            *(titles.get(pair.setting, pair.setting), pair.metric, pair.first, pair.second),
            *_numbers(pair.difference),
            *(pair.wins, pair.losses),
        )
        for pair in pairs
    ]
    return csv_text(names.split(","), lines)


def _numbers(value: Estimate) -> tuple[float, ...]:
    return value.count, value.mean, value.sd, value.median, value.low, value.high


def rich_table(table: Table) -> RichTable:
    """The table for a terminal."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    rich = RichTable(
        title=Text(table.title),
        box=box.SIMPLE_HEAD,
        show_edge=False,
        title_justify="left",
        padding=(0, 1, 0, 0),
    )
    for i, heading in enumerate(table.headings):
        rich.add_column(Text(heading), justify="left" if i == 0 else "right", no_wrap=i == 0)
    for row in table.cells:
        rich.add_row(*(Text(cell) for cell in row))
    return rich


def text(tables: Sequence[Table], width: int = 160) -> str:
    """The tables as plain text."""
    from rich.console import Console

    console = Console(
        file=io.StringIO(),
        width=width,
        force_terminal=False,
        force_jupyter=False,
        color_system=None,
    )
    with console.capture() as capture:
        for table in tables:
            console.print(rich_table(table))
            console.print()
    return "\n".join(line.rstrip() for line in capture.get().rstrip().splitlines()) + "\n"


def _policy_cells(summary: PolicySummary, metrics: Sequence[str], wide: bool) -> tuple[str, ...]:
    failed = f"\n{summary.failed} failed" if summary.failed else ""
    rate = summary.success
    cells = [
        summary.policy,
        f"{summary.episodes}{failed}",
        f"{rate.fraction:.2f}\n[{rate.low:.2f}, {rate.high:.2f}]",
    ]
    for name in metrics:
        value = summary.metrics.get(name)
        if value is None:
            cells.append("")
        elif name in _TIMES:
            worst = summary.metrics[_TIMES[name]].highest
            cells.append(f"{_milliseconds(value.median)}\nmax {_milliseconds(worst)}")
        else:
            cells.append(_estimate(value, _digits(name), wide=wide))
    return tuple(cells)


def _digits(column: str) -> int:
    return METRICS[column].digits if column in METRICS else 3


def _estimate(value: Estimate | None, digits: int, *, wide: bool = True) -> str:
    if value is None:
        return ""
    middle = f"\nmed {_number(value.median, digits)}" if wide else ""
    spread = f"{_number(value.mean, digits)} ± {_number(value.sd, digits)}"
    return f"{spread}\n{_interval(value, digits)}{middle}"


def _interval(value: Estimate, digits: int, *, sign: bool = False) -> str:
    return f"[{_number(value.low, digits, sign=sign)}, {_number(value.high, digits, sign=sign)}]"


def _number(value: float, digits: int, *, sign: bool = False) -> str:
    return f"{value:+.{digits}f}" if sign else f"{value:.{digits}f}"


def _milliseconds(seconds: float) -> str:
    value = 1e3 * seconds
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
