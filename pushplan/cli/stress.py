"""``pushplan stress``: a policy in a robot's loop, under one disturbance after another."""

from __future__ import annotations

import argparse
import os
from typing import Any

from pushplan.cli.common import add_command, add_trust, positive, say, whole
from pushplan.cli.outputs import check_directory
from pushplan.cli.progress import progress_of

_EXAMPLES = """\
  pushplan stress push-aware maze-3d-3
  pushplan stress gtsp-mpc area-clearing-3d-10 --episodes 8 --out runs/stress
  pushplan stress my_planner.py:MyPlanner maze-3d-3 --conditions noise-2cm-3deg,delay-200ms

The exit code is 1 where something that a condition asks for was not reached.
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "stress", "test a policy under noise, delay and other faults", _EXAMPLES, run
    )
    parser.add_argument("policy", metavar="POLICY", help="as one of 'pushplan bench --policies'")
    parser.add_argument("suite", metavar="SUITE", help="see 'pushplan list suites'")
    parser.add_argument(
        "--conditions",
        metavar="A,B",
        help="names ('pushplan list conditions'; default: all that the task can vary)",
    )
    parser.add_argument(
        "--episodes", type=whole(1), default=20, metavar="N", help="of each (default %(default)s)"
    )
    parser.add_argument(
        "--seed", type=whole(0), default=0, metavar="FIRST", help="seed of the first scenario"
    )
    parser.add_argument(
        "--rate",
        type=positive,
        default=20.0,
        metavar="HZ",
        help="of the robot's loop, where the condition does not say (default %(default)g)",
    )
    parser.add_argument(
        "--planning-time",
        type=positive,
        default=0.05,
        metavar="S",
        help="what a planning call takes in the simulated world [s] (default %(default)g)",
    )
    parser.add_argument(
        "--workers",
        type=whole(0),
        default=os.cpu_count() or 1,
        metavar="W",
        help="processes (default: one a core; 0: this process)",
    )
    parser.add_argument("--out", metavar="DIR", help="run directory, to be continued and kept")
    parser.add_argument(
        "--timeout",
        type=positive,
        default=900.0,
        metavar="S",
        help="wall-clock limit of an episode [s] (default %(default)g)",
    )
    add_trust(parser)


def run(options: argparse.Namespace) -> int:
    """Run the test, print the score sheet."""
    from pushplan.evaluation import stress
    from pushplan.evaluation.table_formats import markdown, text

    check_directory(options.out)
    with progress_of(options.policy, out=options.out) as progress:
        sheet = stress(
            options.policy,
            options.suite,
            conditions=options.conditions.split(",") if options.conditions else None,
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

        from pushplan.world.output_files import write_atomic

        write_atomic(Path(options.out) / "stress.md", markdown([table]).encode())
    say(text([table]).rstrip())
    say(table.note)
    return 1 if sheet.missed else 0
