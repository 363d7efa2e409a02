"""``pushplan bench paper``: every policy beside the numbers of the Bench-Push paper."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from pushplan.cli.common import batch_options, say, usage_error

if TYPE_CHECKING:
    from pushplan.evaluation import Comparison

SUITE = "paper"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what only this suite knows."""
    group = parser.add_argument_group("only for 'bench paper'")
    group.add_argument(
        "--only", metavar="A,B", help="some of its tasks and suites (default: all of the paper's)"
    )
    group.add_argument(
        "--markdown", metavar="FILE", help="write the tables there too, as in docs/comparison.md"
    )


def check(options: argparse.Namespace) -> None:
    """Refuse options that do not belong to the suite.

    Raises:
        InvalidInputError: naming the first.
    """
    if options.suite != SUITE:
        if options.policies is None:
            raise usage_error("bench", "the following arguments are required: --policies")
        for name in ("only", "markdown"):
            if getattr(options, name) is not None:
                raise usage_error("bench", f"--{name} is for 'bench {SUITE}' only")
    elif options.latency is not None or options.observation != "auto":
        raise usage_error("bench", f"'bench {SUITE}' takes neither --latency nor --observation")


def compare(options: argparse.Namespace, out: str, progress: Callable[..., None]) -> Comparison:
    """Run what is missing."""
    from pushplan.evaluation import bench_paper
    from pushplan.evaluation.paper import EPISODES

    given = {"only": options.only, "policies": options.policies, "episodes": options.episodes}
    words = [word for key, value in given.items() if value for word in (f"--{key}", str(value))]
    return bench_paper(
        only=options.only,
        policies=options.policies,
        episodes=options.episodes or EPISODES,
        out=out,
        progress=progress,
        command=shlex.join(["pushplan", "bench", SUITE, *words]),
        **batch_options(options),
    )


def show(comparison: Comparison, out: str, markdown: str | None) -> None:
    """Print the tables, write the page of the run, say where everything is."""
    from pushplan.evaluation import Results
    from pushplan.world.files import write_atomic

    say(comparison.table())
    say(f"page:     {Results.load(out).report()}")
    say(f"document: {os.path.join(out, 'paper.md')}, with what the columns are and what compares")
    if markdown is not None:
        write_atomic(Path(markdown), comparison.markdown().encode())
        say(f"document: {markdown}")
