"""``pushplan compile``: compile and cache every kernel ahead of time."""

from __future__ import annotations

import argparse
from typing import Any

from pushplan.cli.common import add_command, say

_EXAMPLES = """\
  pushplan compile
"""


def add(commands: Any) -> None:
    """Add the command."""
    add_command(
        commands, "compile", "compile every kernel now, so that first runs are fast", _EXAMPLES, run
    )


def run(options: argparse.Namespace) -> int:
    """One line for each thing that was run to compile it."""
    from pushplan.evaluation.warmup import WARMUPS, warm_up

    for name in WARMUPS:
        say(f"{name}: {warm_up(name):.1f} s")
    return 0
