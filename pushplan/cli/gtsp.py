"""``pushplan gtsp``: solve a generalized travelling salesman problem from a file."""

from __future__ import annotations

import argparse

from pushplan.cli.common import milliseconds, say_written, tell
from pushplan.cli.output_files import check_file
from pushplan.errors import InvalidInputError


def run(options: argparse.Namespace) -> int:
    """Read, solve, say what was found; 1 if there is no tour."""
    from pushplan.gtsp import GtspConfig, read_gtsp, read_tour, solve_gtsp, write_tour
    from pushplan.world import Deadline, MaxIterations, Stop, stream

    check_file(options.out)
    instance = read_gtsp(options.file)
    count = len(instance.table)
    for node in options.fixed_start:
        if node > count:
            raise InvalidInputError(f"--fixed-start has node {node}, but nodes are 1 to {count}")
    if options.iterations:
        stop: Stop = MaxIterations(options.iterations)
    else:
        stop = Deadline(options.seconds)
    tour = solve_gtsp(
        instance,
        stop=stop,
        rng=stream(options.seed, "gtsp"),
        config=GtspConfig(method=options.method, lower_bound=options.bound),
        initial=read_tour(options.initial) if options.initial else None,
        fixed_start=[node - 1 for node in options.fixed_start],
    )
    stats = tour.stats
    nodes = [int(node) + 1 for node in tour.nodes]
    about = {"name": instance.name, "status": tour.status.label, "cost": tour.cost}
    about |= {"lower_bound": tour.lower_bound, "nodes": nodes, "stats": stats}
    lines = [f"{instance.name}: {count} nodes in {len(instance.clusters)} clusters"]
    if not tour.status.has_tour:
        tell(options, about, *lines, f"  {tour.status.label}: {tour.status.remedy}")
        return 1
    if options.out:
        write_tour(options.out, tour.nodes, name=f"{instance.name} {tour.cost:.10g}")
    tell(
        options,
        about,
        *lines,
        f"  {tour.status.label}, cost {tour.cost:.10g}, lower bound {tour.lower_bound:.10g}",
        f"  {stats.method}, {stats.iterations} rounds, {milliseconds(stats.wall_time_s)}, "
        f"found after {milliseconds(stats.best_s)}",
        "  nodes " + " ".join(map(str, nodes)),
    )
    say_written(options, options.out)
    return 0
