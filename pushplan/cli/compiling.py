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
    from pushplan.evaluation.policies import policy_names
    from pushplan.evaluation.warmup import OTHERS, warm_up

    for name in options.names or (*policy_names(), *OTHERS):
        with kernel_progress(name) as progress:
            took = warm_up(name)
        say(f"{name}: {took:.1f} s, {progress.compiled} kernels compiled, {progress.loaded} loaded")
    return 0
