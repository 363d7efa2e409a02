"""``pushplan score``: metrics of a stored episode."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import (
    add_command,
    check_episode_file,
    load_episode,
    save_episode,
    say,
    say_json,
    say_scores,
)

if TYPE_CHECKING:
    from pushplan.world import Episode

_EXAMPLES = """\
  pushplan score episode.npz
  pushplan score runs/first/episodes/*.npz
  pushplan score episode.npz --metrics E_nav,my_metrics:jerk
  pushplan score robot.mcap
  pushplan score episode.npz --out episode.mcap
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "score", "compute the metrics of stored episodes", _EXAMPLES, run
    )
    parser.add_argument(
        "episodes", nargs="+", metavar="EPISODE", help=".npz, or .mcap as robots log"
    )
    parser.add_argument(
        "--metrics", metavar="A,B", help="names or 'module:function'; all registered by default"
    )
    parser.add_argument(
        "--out", metavar="FILE", help="write the one episode in another format: .mcap or .npz"
    )
    parser.add_argument("--json", action="store_true", help="a list of objects, for scripts")


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
