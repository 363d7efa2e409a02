"""Scores of `gtsp-mpc` and times of its decisions, by their deadline.

    python -m benchmarks.speed.decisions [--suites NAME ...] [--episodes N] [--seed FIRST]

Every episode runs without a deadline and with each of ``--deadlines``. The clock of deadlines is
the CPU time of the thread, so that other jobs of the machine change nothing. A decision is all that
happens between the question for the next push and its answer; the overrun is its time beyond the
deadline. The heap is frozen (`gc.freeze`), as `pushplan.runtime.Runner` freezes it.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from benchmarks.reporting import command_line
from pushplan.control import ImmediateExecutor
from pushplan.evaluation import bench
from pushplan.planners.rearrangement import GtspMpc
from pushplan.world import Deadline, PendingResult, Stop, World

T = TypeVar("T")

SUITES = (
    "area-clearing-2d-10",
    "box-delivery-2d-small-empty-10",
    "area-clearing-3d-10",
    "box-delivery-3d-5",
)


DECISIONS: list[float] = []
"""CPU time of each decision [s]."""


class TimedExecutor(ImmediateExecutor):
    """Notes the CPU time of each call."""

    def submit(
        self, call: Callable[[Stop | None], T], time_s: float, stop: Stop | None = None
    ) -> PendingResult[T]:
        """See `pushplan.world.PlanningExecutor`."""
        began = time.perf_counter()
        result = super().submit(call, time_s, stop)
        DECISIONS.append(time.perf_counter() - began)
        return result


class TimedGtspMpc(GtspMpc):
    """The policy with its decisions timed, and with a deadline [s]."""

    def __init__(self, deadline: float | None) -> None:
        super().__init__(stop=None if deadline is None else Deadline(deadline))

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Begin an episode."""
        super().reset(world, rng)
        self.plan_with(TimedExecutor())


def main() -> None:
    """One row for each suite and deadline."""
    parser = command_line(__doc__)
    parser.add_argument("--suites", nargs="*", default=list(SUITES))
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=400)
    parser.add_argument("--deadlines", nargs="*", type=float, default=[0.1], help="[s]")
    options = parser.parse_args()
    time.perf_counter = time.thread_time
    gc.freeze()
    sys.stdout.write(
        "| suite | deadline [ms] | episodes | S | E | I | duration [s] | decisions "
        "| median [ms] | longest | overrun p99.9 | worst |\n" + 12 * "|---" + "|\n"
    )
    for suite in options.suites:
        for deadline in (None, *options.deadlines):
            DECISIONS.clear()
            results = bench(
                suite,
                [partial(TimedGtspMpc, deadline)],
                episodes=options.episodes,
                seed=options.seed,
                workers=0,
                timeout_s=None,
            )
            scores = [
                f"{np.mean([row.metrics[name] for row in results.rows]):.3f}"
                for name in ("S_manip", "E_manip", "I_manip")
            ]
            duration = np.mean([row.metrics["sim_time_s"] for row in results.rows])
            taken = 1e3 * np.array(DECISIONS)
            late = ["", ""]
            if deadline is not None:
                over = taken - 1e3 * deadline
                late = [f"{np.quantile(over, 0.999):.1f}", f"{over.max():.1f}"]
            cells = [
                suite,
                "" if deadline is None else f"{1e3 * deadline:g}",
                str(len(results.rows)),
                *scores,
                f"{duration:.0f}",
                str(len(taken)),
                f"{np.median(taken):.0f}",
                f"{taken.max():.0f}",
                *late,
            ]
            sys.stdout.write("| " + " | ".join(cells) + " |\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
