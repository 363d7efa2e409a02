"""``pushplan compile``: compile and cache kernels ahead of time."""

from __future__ import annotations

import argparse
import time

from pushplan.cli.common import say
from pushplan.cli.kernel_progress import kernel_progress


def run(options: argparse.Namespace) -> int:
    """One line for each thing that was run to compile it."""
    if options.planners:
        from pushplan.planners import policy_names

        wanted, warm_up = options.names or policy_names(), _warm_up_planner
    else:
        from pushplan.evaluation import warmup

        wanted, warm_up = options.names or warmup.names(), warmup.warm_up
    with kernel_progress(*wanted) as progress:
        for name in wanted:
            compiled, loaded = progress.compiled, progress.loaded
            took = warm_up(name)
            progress.clear()
            compiled, loaded = progress.compiled - compiled, progress.loaded - loaded
            say(f"{name}: {took:.1f} s, {compiled} kernels compiled, {loaded} loaded")
    return 0


def _warm_up_planner(name: str) -> float:
    """Run a planner in small worlds; how long that took [s]."""
    from pushplan.planners import warm_up

    begin = time.perf_counter()
    warm_up(name)
    return time.perf_counter() - begin
