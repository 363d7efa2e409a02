"""``pushplan experiment``: run what an experiment file says."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from pushplan.cli.common import say
from pushplan.cli.outputs import check_directory
from pushplan.cli.progress import run_jobs


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
