"""``pushplan score``: metrics of a stored episode."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import (
    check_episode_file,
    load_episode,
    save_episode,
    say,
    say_json,
    say_scores,
)

if TYPE_CHECKING:
    from pushplan.world import Episode


def run(options: argparse.Namespace) -> int:
    """One block of lines an episode."""
    from pushplan.world import InvalidInputError

    if options.out and len(options.episodes) > 1:
        raise InvalidInputError(f"--out writes one episode, got {len(options.episodes)}")
    check_episode_file(options.out)
    names = options.metrics.split(",") if options.metrics else None
    scored = []
    for path in options.episodes:
        episode = load_episode(path)
        if options.json:
            scored.append(_as_dict(path, episode, names))
        else:
            say_scores(episode, names, f"{path}: ")
        if options.out:
            save_episode(episode, options.out)
            if not options.json:
                say(f"wrote {options.out}")
    if options.json:
        say_json(scored)
    return 0


def _as_dict(path: str, episode: Episode, names: Sequence[str] | None) -> dict[str, Any]:
    from pushplan.metrics import compute

    ended = {"episode": path, "success": episode.success, "reason": episode.reason}
    return {**ended, "metrics": dict(compute(episode, names))}
