"""``pushplan bounds``: how good a solution of a scenario can be, and how good the best known is."""

from __future__ import annotations

import argparse

from pushplan.cli.common import tell
from pushplan.cli.output_files import check_file


def run(options: argparse.Namespace) -> int:
    """Bound, look for solutions, print a line for each scenario."""
    from pathlib import Path

    from pushplan.evaluation import Results
    from pushplan.evaluation.statistics.gaps import scenario_bound, with_solutions
    from pushplan.scenarios import suite
    from pushplan.scenarios.known_bounds import known_bounds, load_bounds, save_bounds

    check_file(options.out, [".csv"])
    runs = [Results.load(path) for path in options.runs or ()]
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
    lines = []
    for key in (one.key for one in scenarios):
        best = ""
        if (work := found[key].best) is not None:
            best = f", best known {work:.4g} kg m ({found[key].best_policy})"
        lines.append(f"{key}: bound {found[key].bound:.4g} kg m{best}")
    tell(options, [{"scenario": one.key, **vars(found[one.key])} for one in scenarios], *lines)
    if options.out is not None:
        save_bounds(options.out, found)
    return 0
