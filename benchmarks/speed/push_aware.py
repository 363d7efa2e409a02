"""How soon the push-aware planner has a plan, and how good its plans are how soon.

    python -m benchmarks.speed.push_aware [--worlds 24] [--suite maze-2d-10] [--cpu]

With ``--cpu`` by the time of the processor, which a busy machine changes less.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.reporting import command_line, head, origin, percentiles, row, write
from pushplan.envs import make
from pushplan.planners import make_planner
from pushplan.planners.push_aware import PushAware
from pushplan.scenarios import suite
from pushplan.world import (
    FirstSolution,
    Stop,
    StopCheck,
    World,
)

BUDGETS = (0.02, 0.05, 0.1, 0.25, 1.0)


Clock = Callable[[], float]


@dataclass(frozen=True)
class Until(Stop):
    """A deadline by any clock [s]."""

    seconds: float = 1.0
    clock: Clock = time.perf_counter

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        end = self.clock() + self.seconds
        return lambda done, cost: self.clock() >= end


def worlds(name: str, count: int, seed: int) -> list[World]:
    """The starts of the first scenarios of a suite, for a robot that may slow down."""
    found = []
    for scenario in suite(name, episodes=count, first_seed=seed).scenarios:
        env = make(scenario, observation="state", action="velocity")
        env.reset(seed=scenario.seed)
        found.append(env.world)
    return found


def anytime(names: list[str], count: int, seed: int, longest: float, clock: Clock) -> None:
    """Cost after a time over the cost after the longest, and the time of the first plan."""
    planner = make_planner("push-aware")
    assert isinstance(planner, PushAware)
    write("First plan [ms], one call each:\n")
    head("suite", "planner", "median", "p95", "p99", "max")
    scenes = {name: worlds(name, count, seed) for name in names}
    for name in names:
        for label in ("kinodynamic-rrt", "push-aware"):
            times = [first_plan(label, world, i, clock) for i, world in enumerate(scenes[name])]
            row(f"`{name}`", f"`{label}`", *percentiles(times))
    write(f"\nCost after a time, over that after {longest:g} s, and its gap to the lower bound:\n")
    columns = [f"{1e3 * budget:.0f} ms" for budget in BUDGETS]
    head("suite", "", *columns, "gap", "expansions/s", "shortcuts and edges/s")
    for name in names:
        planner.plan(scenes[name][0], stop=Until(1.0, clock))  # makes the table of this map
        ratios = []
        gaps = []
        rates = []
        for i, world in enumerate(scenes[name]):
            found = []
            for budget in (*BUDGETS, longest):
                rng = np.random.default_rng(i)
                result = planner.plan(world, stop=Until(budget, clock), rng=rng)
                found.append(result.stats.detail.get("cost", np.inf))
            if not np.isfinite(found[-1]):
                continue  # nothing to compare with: no plan at all
            stats = result.stats
            ratios.append(np.array(found[:-1]) / found[-1])
            gaps.append(stats.detail["gap"])
            expansions = stats.detail["expansions"]
            rates.append((expansions / longest, (stats.iterations - expansions) / longest))
        rate = np.median(rates, axis=0)
        for label, share in (("median", 50), ("p90", 90)):
            cells = np.percentile(ratios, share, axis=0, method="nearest")
            values = [f"{value:.3f}" for value in (*cells, np.percentile(gaps, share))]
            row(f"`{name}`", label, *values, *(f"{value:.0f}" for value in rate))


def first_plan(name: str, world: World, seed: int, clock: Clock) -> float:
    """Time of a call that returns its first plan [ms]."""
    planner = make_planner(name)
    began = clock()
    planner.plan(world, stop=FirstSolution() | Until(2.0, clock), rng=np.random.default_rng(seed))
    return 1e3 * (clock() - began)


def main() -> None:
    """Time planning calls."""
    parser = command_line(__doc__, seed=0)
    parser.add_argument("--suite", default="maze-2d-3,maze-2d-10", help="names with commas between")
    parser.add_argument("--cpu", action="store_true", help="time of the processor")
    parser.add_argument("--worlds", type=int, default=24, help="of a suite; default 24")
    parser.add_argument("--long", type=float, default=10.0, help="longest call [s]; default 10")
    given = parser.parse_args()
    write(f"{origin()}\n")
    clock = time.thread_time if given.cpu else time.perf_counter
    anytime(given.suite.split(","), given.worlds, given.seed, given.long, clock)


if __name__ == "__main__":
    main()
