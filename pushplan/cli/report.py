"""``pushplan report``: table, plots and page of a stored run."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import say, say_json

if TYPE_CHECKING:
    from pushplan.evaluation import Results
    from pushplan.evaluation.report.tables import Table


def run(options: argparse.Namespace) -> int:
    """Print the table and write the files."""
    from pushplan.evaluation import Results
    from pushplan.evaluation.report import table_formats

    results = Results.load(options.directory)
    if options.metrics is None and options.format is None:
        figures = options.figures or ()
        show(results, options, replays=options.replays, most=options.replay_most, figures=figures)
        return 0
    if options.metrics:
        tables = results.measure(options.metrics)
    else:
        tables = results.tables(settings=options.settings, pairs=options.pairs)
    if options.format is None:
        _print(tables)
    else:
        say(getattr(table_formats, options.format)(tables).rstrip())
    return 0


def show(results: Results, options: argparse.Namespace, **written: Any) -> None:
    """Print the tables of a run and why episodes did not succeed, write its report.

    Args:
        results: of the run.
        options: with the shared options "tables".
        written: as for `Results.report`.
    """
    from pushplan.evaluation.report.endings import unsuccessful_lines
    from pushplan.evaluation.report.tables import on_few_lines

    tables = results.tables(settings=options.settings, pairs=options.pairs)
    _print(on_few_lines(tables))
    for line in unsuccessful_lines(results):
        say(line)
    if len(results.titles) > 1 and not options.settings:
        say(f"each of the {len(results.titles)} settings: --settings, and on the page")
    page = results.report(pairs=options.pairs, **written)
    say(f"page:    {page}")


def show_json(results: Results, pairs: str) -> None:
    """Write the report of a run, and print what its tables say as JSON."""
    page = results.report(pairs=pairs)
    runs = [results.pooled, results] if len(results.titles) > 1 else [results]
    summaries = [
        {**asdict(one), "title": run.titles[one.setting]} for run in runs for one in run.summary()
    ]
    compared = [one for run in runs for one in run.compare(pairs)]
    differences = [{**asdict(one), "verdict": one.verdict} for one in compared]
    say_json({"page": str(page), "policies": summaries, "differences": differences})


def exit_code(results: Results) -> int:
    """1 where jobs of a run failed, with a line for each policy that says why; else 0."""
    from pushplan.evaluation.report.endings import failure_lines

    lines = failure_lines(results)
    for line in lines:
        sys.stderr.write(f"{line}\n")
    return 1 if lines else 0


def _print(tables: Sequence[Table]) -> None:
    """In colour and to the width of a terminal, or as plain text."""
    from rich.console import Console

    from pushplan.evaluation.report.table_formats import rich_table, text

    if not sys.stdout.isatty():
        say(text(tables))
        return
    console = Console()
    for table in tables:
        console.print(rich_table(table))
        console.print()
