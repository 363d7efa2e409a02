"""``pushplan bounds``: how good a solution of a scenario can be, and how good the best known is."""

from __future__ import annotations

import argparse
from typing import Any

from pushplan.cli.common import add_command, say, whole

_EXAMPLES = """\
  pushplan bounds maze-2d-10 --episodes 5
  pushplan bounds maze-2d-5,maze-2d-10 --runs runs/first,runs/second --out bounds.csv

What is bounded is the work of robot and objects, m0 l0 + sum of mi li [kg m], of a successful
episode. Best known solutions are those of stored runs, and those that ship with pushplan. A file
that exists is gone on with: its best solutions are kept, its scenarios are not bounded again.
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "bounds", "how good solutions can be", _EXAMPLES, run)
    parser.add_argument("suites", metavar="SUITE,...", help="see 'pushplan list suites'")
    parser.add_argument("--episodes", type=whole(1), metavar="N", help="default: the suite's own")
    parser.add_argument(
        "--seed", type=whole(0), default=0, metavar="FIRST", help="seed of the first scenario"
    )
    parser.add_argument("--runs", metavar="DIR,...", help="run directories with solutions")
    parser.add_argument(
        "--nodes", type=whole(1), default=400, metavar="N", help="of a proof (default %(default)s)"
    )
    parser.add_argument("--out", metavar="FILE.csv", help="write, or go on with, this file")


def run(options: argparse.Namespace) -> int:
    """Bound, look for solutions, print a line for each scenario."""
    from pathlib import Path

    from pushplan.evaluation.bounding import scenario_bound, with_solutions
    from pushplan.scenarios import suite
    from pushplan.scenarios.known_bounds import known_bounds, load_bounds, save_bounds

    out = None if options.out is None else Path(options.out)
    found = dict(known_bounds())
    if out is not None and out.exists():
        found |= load_bounds(out)
    keys = []
    for name in options.suites.split(","):
        for scenario in suite(name, episodes=options.episodes, first_seed=options.seed).scenarios:
            keys.append(scenario.key)
            if scenario.key not in found:
                found[scenario.key] = scenario_bound(scenario, most_nodes=options.nodes)
    found = with_solutions(found, options.runs.split(",") if options.runs else ())
    for key in keys:
        one = found[key]
        best = "" if one.best is None else f", best {one.best:.4g} ({one.best_policy})"
        say(f"{key}: bound {one.bound:.4g}{best} kg m")
    if out is not None:
        save_bounds(out, found)
        say(f"{len(found)} scenarios in {out}")
    return 0
