"""``pushplan score``: metrics of a stored episode."""

from __future__ import annotations

import argparse
from typing import Any

from pushplan.cli.common import add_command, say_scores

_EXAMPLES = """\
  pushplan score episode.npz
  pushplan score runs/first/episodes/*.npz
  pushplan score episode.npz --metrics E_nav,my_metrics:jerk
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "score", "compute the metrics of stored episodes", _EXAMPLES, run
    )
    parser.add_argument("episodes", nargs="+", metavar="EPISODE.npz")
    parser.add_argument(
        "--metrics", metavar="A,B", help="names or 'module:function'; all registered by default"
    )


def run(options: argparse.Namespace) -> int:
    """One block of lines an episode."""
    from pushplan.world import Episode

    names = options.metrics.split(",") if options.metrics else None
    for path in options.episodes:
        episode = Episode.load(path)
        say_scores(episode, names, f"{path}: ")
    return 0
