"""``pushplan gtsp``: solve a generalized travelling salesman problem from a file."""

from __future__ import annotations

import argparse
from typing import Any

from pushplan.cli.common import add_command, milliseconds, positive, say, whole
from pushplan.cli.kernel_progress import kernel_progress
from pushplan.cli.outputs import check_file

_EXAMPLES = """\
  pushplan gtsp boxes.gtsp --seconds 1
  pushplan gtsp boxes.gtsp --seconds 10 --bound --out boxes.gtsp-tour
  pushplan gtsp boxes.gtsp --iterations 20000 --seed 3
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "gtsp", "find a tour through one node of every cluster", _EXAMPLES, run
    )
    parser.add_argument("file", metavar="FILE.gtsp", help="instance in GTSPLIB format")
    parser.add_argument(
        "--seconds", type=positive, default=1.0, metavar="S", help="time budget (default 1)"
    )
    parser.add_argument(
        "--iterations",
        type=whole(1),
        metavar="N",
        help="rounds of the search instead of a time budget: the same tour on every machine",
    )
    parser.add_argument("--seed", type=whole(0), default=0, help="of the search (default 0)")
    parser.add_argument(
        "--method",
        choices=("auto", "exact", "search"),
        default="auto",
        help="exact: dynamic programming; auto: exact where that is fast (default auto)",
    )
    parser.add_argument(
        "--bound", action="store_true", help="spend 70 %% of the time on a lower bound and a proof"
    )
    parser.add_argument("--out", metavar="FILE.gtsp-tour", help="write the tour")


def run(options: argparse.Namespace) -> int:
    """Read, solve, say what was found; 1 if there is no tour."""
    from pushplan.gtsp import GtspConfig, read_gtsp, solve_gtsp, warm_up_solver, write_tour
    from pushplan.world import Deadline, MaxIterations, stream

    check_file(options.out)
    instance = read_gtsp(options.file)
    with kernel_progress():
        warm_up_solver()
    stop = MaxIterations(options.iterations) if options.iterations else Deadline(options.seconds)
    tour = solve_gtsp(
        instance.costs,
        instance.clusters,
        stop=stop,
        rng=stream(options.seed, "gtsp"),
        config=GtspConfig(method=options.method, lower_bound=options.bound),
    )
    say(f"{instance.name}: {len(instance.costs)} nodes in {len(instance.clusters)} clusters")
    stats = tour.stats
    if not tour.status.has_tour:
        say(f"  {tour.status.label}: {tour.status.remedy}")
        return 1
    say(f"  {tour.status.label}, cost {tour.cost:.10g}, lower bound {tour.lower_bound:.10g}")
    say(
        f"  {stats.method}, {stats.iterations} rounds, {milliseconds(stats.wall_time_s)}, "
        f"found after {milliseconds(stats.best_s)}"
    )
    say("  nodes " + " ".join(str(node + 1) for node in tour.nodes))
    if options.out:
        write_tour(options.out, tour.nodes, name=f"{instance.name} {tour.cost:.10g}")
        say(f"wrote {options.out}")
    return 0
