"""``pushplan compile``: compile and cache kernels ahead of time."""

from __future__ import annotations

import argparse
import time

from pushplan.cli.common import say
from pushplan.cli.kernel_progress import kernel_progress


def run(options: argparse.Namespace) -> int:
    """One line for each thing that was run to compile it."""
    if options.planners:
        from pushplan.planners import policy_names as known
        from pushplan.planners import warm_up
    else:
        from pushplan.evaluation.run.warmup import names as known
        from pushplan.evaluation.run.warmup import warm_up
    wanted = options.names or known()
    with kernel_progress(*wanted) as progress:
        for name in wanted:
            compiled = progress.compiled
            loaded = progress.loaded
            begin = time.perf_counter()
            warm_up(name)
            took = time.perf_counter() - begin
            progress.clear()
            compiled = progress.compiled - compiled
            loaded = progress.loaded - loaded
            say(f"{name}: {took:.1f} s, {compiled} kernels compiled, {loaded} loaded")
    return 0
