"""``pushplan stress``: a policy in a robot's loop, under one disturbance after another."""

from __future__ import annotations

import argparse

from pushplan.cli.common import say
from pushplan.cli.outputs import check_directory
from pushplan.cli.progress import progress_of


def run(options: argparse.Namespace) -> int:
    """Run the test, print the score sheet."""
    from pushplan.evaluation import stress
    from pushplan.evaluation.report.table_formats import markdown, text

    check_directory(options.out)
    with progress_of(options.policy, out=options.out) as progress:
        sheet = stress(
            options.policy,
            options.suite,
            conditions=options.conditions,
            episodes=options.episodes,
            seed=options.seed,
            rate=options.rate,
            planning_time=options.planning_time,
            workers=options.workers,
            out=options.out,
            timeout_s=options.timeout,
            progress=progress,
        )
    table = sheet.table()
    if options.out is not None:
        from pathlib import Path

        from pushplan.files.output_files import write_atomic

        write_atomic(Path(options.out) / "stress.md", markdown([table]).encode())
    say(text([table]).rstrip())
    say(table.note)
    return 1 if sheet.missed else 0
