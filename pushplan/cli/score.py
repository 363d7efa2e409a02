"""``pushplan score``: metrics of a stored episode."""

from __future__ import annotations

import argparse

from pushplan.cli.common import (
    check_episode_file,
    load_episode,
    save_episode,
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
