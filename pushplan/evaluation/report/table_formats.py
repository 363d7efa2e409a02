"""Tables as Markdown, LaTeX, CSV and text."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pushplan.evaluation.report.latex_tables import latex as latex
from pushplan.evaluation.report.tables import RUNS_NOTE, Table
from pushplan.evaluation.statistics.summary import PairedDifference, PolicySummary
from pushplan.evaluation.store.rows import csv_text

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table as RichTable


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
    lines = []
    for summary in summaries:
        who = {"setting": titles.get(summary.setting, summary.setting), "policy": summary.policy}
        rate = {"mean": summary.success.fraction, **vars(summary.success)}
        lines.append({**who, "metric": "success", **rate})
        lines += [{**who, "metric": name, **vars(one)} for name, one in summary.metrics.items()]
    return _csv("setting,policy,metric,count,mean,sd,median,low,high", lines)


def differences_csv(pairs: Sequence[PairedDifference], titles: dict[str, str]) -> str:
    """One line for each setting, metric and pair of policies, with all digits."""
    names = (
        "setting,metric,first,second,count,mean,sd,median,low,high,better,worse,p_value,"
        "p_corrected,effect,needed,verdict"
    )
    lines = []
    for pair in pairs:
        title = titles.get(pair.setting, pair.setting)
        facts = {**vars(pair), "setting": title, "verdict": pair.verdict}
        lines.append({**facts, **vars(pair.difference)})
    return _csv(names, lines)


def _csv(names: str, lines: Sequence[Mapping[str, object]]) -> str:
    """The values of these names, with commas between them; an empty field for None and NaN."""
    header = names.split(",")
    found = [[line.get(name) for name in header] for line in lines]
    # NaN alone is not equal to itself
    return csv_text(header, [[one if one == one else None for one in line] for line in found])


def print_tables(tables: Sequence[Table], console: Console) -> None:
    """Print tables on a terminal, and below them `RUNS_NOTE` if it belongs to one."""
    for table in tables:
        console.print(rich_table(table))
        console.print()
    if any(RUNS_NOTE in table.note for table in tables):
        console.print(RUNS_NOTE, markup=False, highlight=False)


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
        print_tables(tables, console)
    return "\n".join(line.rstrip() for line in capture.get().rstrip().splitlines()) + "\n"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
