"""``pushplan bounds``: how good a solution of a scenario can be, and how good the best known is."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from pushplan.cli.common import add_command, say, say_json, whole
from pushplan.cli.outputs import check_file

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
    parser.add_argument("--anew", action="store_true", help="prove those again that are known")
    parser.add_argument("--out", metavar="FILE.csv", help="write, or go on with, this file")
    parser.add_argument("--json", action="store_true", help="print them as JSON")


def run(options: argparse.Namespace) -> int:
    """Bound, look for solutions, print a line for each scenario."""
    from pathlib import Path

    from pushplan.evaluation import Results
    from pushplan.evaluation.bounding import scenario_bound, with_solutions
    from pushplan.scenarios import suite
    from pushplan.scenarios.known_bounds import known_bounds, load_bounds, save_bounds

    check_file(options.out, [".csv"])
    runs = [Results.load(path) for path in options.runs.split(",")] if options.runs else []
    scenarios = [
        scenario
        for name in options.suites.split(",")
        for scenario in suite(name, episodes=options.episodes, first_seed=options.seed).scenarios
    ]
    found = dict(known_bounds())
    if options.out is not None and Path(options.out).exists():
        found |= load_bounds(options.out)
    for scenario in scenarios:
        if options.anew or scenario.key not in found:
            proven = scenario_bound(scenario, most_nodes=options.nodes)
            if (known := found.get(scenario.key)) is not None and known.best is not None:
                proven = proven.better(known.best, known.best_policy)
            found[scenario.key] = proven
    found = with_solutions(found, runs)
    if options.json:
        say_json([{"scenario": one.key, **asdict(found[one.key])} for one in scenarios])
    else:
        for key in (one.key for one in scenarios):
            best = ""
            if (work := found[key].best) is not None:
                best = f", best known {work:.4g} kg m ({found[key].best_policy})"
            say(f"{key}: bound {found[key].bound:.4g} kg m{best}")
    if options.out is not None:
        save_bounds(options.out, found)
    return 0
