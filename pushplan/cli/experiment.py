"""``pushplan experiment``: run what an experiment file says."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from pushplan.cli.common import add_command, add_run_options, add_trust, say
from pushplan.cli.outputs import check_directory
from pushplan.cli.progress import run_jobs
from pushplan.cli.report import add_table_options

_EXAMPLES = """\
  pushplan experiment study.yaml
  pushplan experiment study.yaml --check
  pushplan experiment study.yaml --workers 8 --out runs/study

A run that was interrupted or killed continues when the same command is given again; suites,
policies and episodes may be added to the file. See docs/evaluation.md for its format.
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "experiment", "run an experiment file", _EXAMPLES, run)
    parser.add_argument("file", metavar="FILE.yaml", help="suites, policies, parameters, metrics")
    parser.add_argument("--out", metavar="DIR", help="run directory (default: runs/NAME of FILE)")
    add_run_options(parser)
    add_table_options(parser)
    add_trust(parser)


def run(options: argparse.Namespace) -> int:
    """Check the file, run its jobs, print the tables, write plots and page."""
    from pushplan.cli.report import exit_code, show
    from pushplan.evaluation import Experiment

    experiment = Experiment.load(options.file)
    jobs = experiment.jobs
    for (title, label), why in experiment.skipped.items():
        say(f"left out: {label} in {title}: {why}")
    if options.check:
        for suite in experiment.suites:
            scenario = suite.scenarios[0]
            labels = [job.policy.label for job in jobs if job.scenario == scenario]
            say(f"{suite.name}: {len(suite.scenarios)} scenarios, {', '.join(labels)}")
    out = options.out or os.path.join("runs", Path(options.file).stem)
    check_directory(out)
    results = run_jobs(experiment, out, options)
    if results is None:
        return 0
    show(results, options)
    return exit_code(results)
