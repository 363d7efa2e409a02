"""``pushplan bench``: compare policies on a suite."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from pushplan.cli.outputs import check_directory
from pushplan.cli.progress import run_jobs


def run(options: argparse.Namespace) -> int:
    """Run the batch, print the table, write plots and page."""
    from pushplan.cli.report import exit_code, show, show_json
    from pushplan.evaluation.benchmark import bench_experiment
    from pushplan.world import InvalidInputError

    if options.policies is None:  # the parser would say so before it names a misspelt option
        raise InvalidInputError(
            "the following arguments are required: --policies; see 'pushplan bench --help'"
        )
    out = options.out
    if not out:  # folders of worlds count by their names
        names = [
            Path(one).resolve().name if "/" in one else one for one in options.suite.split(",")
        ]
        out = os.path.join("runs", ",".join(names))
    check_directory(out)
    experiment = bench_experiment(
        options.suite,
        options.policies,
        episodes=options.episodes,
        observation=options.observation,
        latency_factor=options.latency,
        seed=options.seed,
        timeout_s=options.timeout,
        memory_limit_mb=options.memory,
    )
    results = run_jobs(experiment, out, options)
    if results is None:
        return 0
    if options.json:
        show_json(results, options.pairs)
    else:
        show(results, options)
    return exit_code(results)
