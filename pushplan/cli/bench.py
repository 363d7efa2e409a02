"""``pushplan bench``: compare policies on a suite."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from pushplan.cli.common import (
    add_command,
    add_latency,
    add_run_options,
    add_trust,
    complete,
    positive,
    whole,
)
from pushplan.cli.outputs import check_directory
from pushplan.cli.progress import run_jobs
from pushplan.cli.report import add_table_options

_EXAMPLES = """\
  pushplan bench maze-2d-5 --policies straight,kinodynamic-rrt --episodes 20 --out runs/first
  pushplan bench maze-2d-5 --policies straight,my_planner.py:MyPlanner --out runs/mine
  pushplan bench maze-2d-10 --policies fast=my_planner.py:fast,slow=my_planner.py:slow

A run that was interrupted or killed continues when the same command is given again.
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "bench", "compare policies on a suite", _EXAMPLES, run)
    suite = parser.add_argument("suite", metavar="SUITE,...", help="see 'pushplan list suites'")
    complete(suite, "suites")
    policies = parser.add_argument(
        "--policies",
        metavar="A,B",
        help="names ('pushplan list policies'), 'onnx:FILE', 'sb3:FILE', 'file.py:Class' or "
        "'module:Class' of a policy or a planner, each with 'label=' in front if wanted",
    )
    complete(policies, "policies")
    parser.add_argument(
        "--episodes",
        type=whole(1),
        metavar="N",
        help="default: the suite's own, 1 for each file of a folder",
    )
    parser.add_argument("--out", metavar="DIR", help="run directory (default: runs/SUITE)")
    parser.add_argument(
        "--seed", type=whole(0), default=0, metavar="FIRST", help="seed of the first scenario"
    )
    parser.add_argument(
        "--timeout",
        type=positive,
        default=300.0,
        metavar="S",
        help="wall-clock limit of an episode [s] (default %(default)g)",
    )
    parser.add_argument(
        "--observation",
        choices=("auto", "image", "state"),
        default="auto",
        help="what the environment observes; auto: what the policy asks for, else state",
    )
    parser.add_argument(
        "--memory",
        type=positive,
        default=4000.0,
        metavar="MB",
        help="memory of a worker beyond which its episode fails (default %(default)g)",
    )
    add_latency(parser)
    add_trust(parser)
    add_run_options(parser)
    add_table_options(parser)
    parser.add_argument("--json", action="store_true", help="print the end's tables as JSON")


def run(options: argparse.Namespace) -> int:
    """Run the batch, print the table, write plots and page."""
    from pushplan.cli.report import exit_code, show, show_json
    from pushplan.evaluation.benchmark import bench_experiment
    from pushplan.world import InvalidInputError

    if options.policies is None:  # the parser would say so before it names a misspelt option
        raise InvalidInputError(
            "the following arguments are required: --policies; see 'pushplan bench --help'"
        )
    out = options.out or _default_out(options.suite)
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


def _default_out(suites: str) -> str:
    """The run directory of suites, and of folders of worlds by their names."""
    names = (Path(name).resolve().name if "/" in name else name for name in suites.split(","))
    return os.path.join("runs", ",".join(names))
