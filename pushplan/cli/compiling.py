"""``pushplan compile``: compile and cache kernels ahead of time."""

from __future__ import annotations

import argparse
from typing import Any

from pushplan.cli.common import add_command, say
from pushplan.cli.kernel_progress import kernel_progress

_EXAMPLES = """\
  pushplan compile
  pushplan compile kinodynamic-rrt push-aware
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "compile", "compile kernels now, so that first runs are fast", _EXAMPLES, run
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="policies, observations, metrics (default: all)"
    )


def run(options: argparse.Namespace) -> int:
    """One line for each thing that was run to compile it."""
    from pushplan.evaluation.warmup import names, warm_up

    wanted = options.names or names()
    with kernel_progress(*wanted) as progress:
        for name in wanted:
            compiled, loaded = progress.compiled, progress.loaded
            took = warm_up(name)
            progress.clear()
            compiled, loaded = progress.compiled - compiled, progress.loaded - loaded
            say(f"{name}: {took:.1f} s, {compiled} kernels compiled, {loaded} loaded")
    return 0
