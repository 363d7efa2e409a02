"""``pushplan score``, ``identify`` and ``bounds``: figures of episodes and of scenarios."""

from __future__ import annotations

import argparse

from pushplan.cli.common import (
    check_episode_file,
    load_episode,
    save_episode,
    say,
    say_json,
    say_scores,
    say_written,
    tell,
)
from pushplan.cli.output_files import check_file


def run(options: argparse.Namespace) -> int:
    """One block of lines an episode."""
    from pushplan.metrics import compute
    from pushplan.world import InvalidInputError

    if options.out and len(options.episodes) > 1:
        raise InvalidInputError(f"--out writes one episode, got {len(options.episodes)}")
    check_episode_file(options.out)
    scored = []
    for path in options.episodes:
        episode = load_episode(path)
        if options.out:
            save_episode(episode, options.out)
        if options.json:
            scored.append(
                {
                    "episode": path,
                    "success": episode.success,
                    "reason": episode.reason,
                    "metrics": dict(compute(episode, options.metrics)),
                }
            )
        else:
            say_scores(episode, options.metrics, f"{path}: ")
        say_written(options, options.out)
    if options.json:
        say_json(scored)
    return 0


def identify(options: argparse.Namespace) -> int:
    """Find pushes, identify, print the parameters."""
    from pushplan import interaction

    pushes = []
    for log in options.logs:
        pushes += interaction.find_pushes(load_episode(log), options.objects)
    found = interaction.identify(pushes)
    if options.json:
        say_json(found.to_dict())
        return 0
    names = ["friction", "gyration scale", "friction at walls, not observed"]
    if found.saw_walls:
        names[2] = "friction at walls"
    say(f"{found.pushes} pushes, predicted ends miss by {1e3 * found.miss:.2g} mm")
    for name, value, deviation in zip(names, found.values, found.deviations, strict=True):
        say(f"  {name:33s}{value:.3f} +- {deviation:.3f}")
    overlap = f"{1e3 * found.overlap:.2f} +- {1e3 * found.overlap_deviation:.2f} mm"
    say(f"  {'overlap in contact':33s}{overlap}")
    return 0


def bounds(options: argparse.Namespace) -> int:
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
