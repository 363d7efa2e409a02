"""``pushplan report``: table, plots and page of a stored run."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import say, say_json

if TYPE_CHECKING:
    from pushplan.evaluation import Results
    from pushplan.evaluation.report.tables import Table

_MOST_LINES = 6
"""From more policies on, one line says why episodes did not succeed."""


def run(options: argparse.Namespace) -> int:
    """Print the table and write the files."""
    from pushplan.evaluation import Results
    from pushplan.evaluation.report import table_formats

    results = Results.load(options.directory)
    if options.metrics is None and options.format is None:
        written = {"replays": options.replays, "most": options.replay_most}
        tell_results = show_json if options.json else show
        tell_results(results, options, figures=options.figures or (), **written)
        return 0
    if options.metrics:
        tables = results.measure(options.metrics)
    else:
        tables = results.tables(settings=options.settings, pairs=options.pairs)
    sys.stderr.writelines(f"{line}\n" for line in results.remarks)
    if options.json:
        say_json(tables)
    elif options.format is None:
        _print(tables)
    else:
        say(getattr(table_formats, options.format)(tables).rstrip())
    return 0


def show(results: Results, options: argparse.Namespace, **written: Any) -> None:
    """Write the report of a run, print its tables and why episodes did not succeed.

    Args:
        results: of the run.
        options: with the shared options "tables".
        written: as for `Results.report`.
    """
    from pushplan.evaluation.report.tables import on_few_lines

    try:
        page = results.report(pairs=options.pairs, **written)
    finally:  # the tables are of use without a page, too
        tables = results.tables(settings=options.settings, pairs=options.pairs)
        _print(on_few_lines(tables))
        for line in [*_unsuccessful_lines(results), *results.remarks]:
            say(line)
        if len(results.titles) > 1 and not options.settings:
            say(f"each of the {len(results.titles)} settings: --settings, and on the page")
    say(f"page:    {page}")


def show_json(results: Results, options: argparse.Namespace, **written: Any) -> None:
    """Write the report of a run, and print what its tables say as JSON; arguments as for `show`."""
    pairs = options.pairs
    page = results.report(pairs=pairs, **written)
    runs = [results]
    if len(results.titles) > 1:
        runs = [results.pooled, results]
    summaries = [
        {**asdict(one), "title": run.titles[one.setting]} for run in runs for one in run.summary()
    ]
    compared = [one for run in runs for one in run.compare(pairs)]
    differences = [{**asdict(one), "verdict": one.verdict} for one in compared]
    found = {"page": str(page), "policies": summaries, "differences": differences}
    say_json({**found, "remarks": results.remarks})


def exit_code(results: Results) -> int:
    """1 where jobs of a run failed, with a line for each policy that says why; else 0.

    A line has the number of failures, the most frequent reason and the file of a traceback.
    """
    code = 0
    for policy in results.policies:
        rows = [row for row in results.rows if row.policy == policy]
        failed = [row for row in rows if row.failed]
        if not failed:
            continue
        code = 1
        ((reason, count),) = Counter(row.reason for row in failed).most_common(1)
        most = "" if count == len(failed) else f", {count} of these"
        line = f"{policy}: {len(failed)} of {len(rows)} failed{most}: {reason}"
        path = results.path
        files = (path / row.detail_file for row in failed if path and row.reason == reason)
        if (file := next((one for one in files if one.is_file()), None)) is not None:
            line += f"; traceback: {file}"
        sys.stderr.write(f"{line}\n")
    return code


def _unsuccessful_lines(run: Results) -> list[str]:
    """A line for each policy with episodes that ended by the rules of their task without success.

    It says how many ended for each reason. More than `_MOST_LINES` policies have one together.
    """
    ended = [row for row in run.rows if not row.failed and not row.success]
    groups = {policy: [row for row in ended if row.policy == policy] for policy in run.policies}
    if len(groups) > _MOST_LINES:
        groups = {f"all {len(groups)} policies": ended}
    lines = []
    for policy, rows in groups.items():
        if rows:
            reasons = Counter(row.reason for row in rows).most_common()
            listed = ", ".join(f"{count} {reason}" for reason, count in reasons)
            lines.append(f"{policy} without success: {listed}")
    return lines


def _print(tables: Sequence[Table]) -> None:
    """In colour and to the width of a terminal, or as plain text."""
    from rich.console import Console

    from pushplan.evaluation.report.table_formats import print_tables, text

    if sys.stdout.isatty():
        print_tables(tables, Console())
    else:
        say(text(tables))
