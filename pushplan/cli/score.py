"""``pushplan score`` and ``identify``: metrics and contact parameters from stored episodes."""

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
)


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
