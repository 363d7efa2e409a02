"""By how much planning calls and decisions overrun their time limit: everything, in one table.

    python -m benchmarks.speed.overruns [CALLS] [--names NAME ...] [--sources NAME ...]
                                        [--barn FOLDER] [--nav2 FOLDER] [--busy N]

Every planner, and every policy whose decisions take a time limit, is called CALLS times with each
limit, in turn on starts of all suites that it can be used in, of which the offices are three, on
the worlds of BARN and on the maps of ROS's map server where their folders are given (as for
`benchmarks.accuracy.real_maps`). Limit and overrun are CPU time, so that the ``--busy`` processes,
which compute beside it, and other work change caches alone. The heap is frozen as by a `Runner`.
"""

from __future__ import annotations

import atexit
import gc
import time
from collections.abc import Callable, Iterator
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np

from benchmarks.accuracy.real_maps import barn_cases, nav2_cases
from benchmarks.first_plan import CpuDeadline
from benchmarks.reporting import command_line, head, origin, percentiles, row, write
from benchmarks.speed.deadlines import MAZE, SHIP
from benchmarks.speed.robot_loop import busy
from pushplan.control import ImmediateExecutor
from pushplan.envs import make
from pushplan.planners import make_planner, make_policy
from pushplan.scenarios import suite, suite_names
from pushplan.world import PushplanError, World, jackal

LIMITS_S = (0.05, 0.1)
DECIDING = ("gtsp-mpc", "mppi", "cem")
STARTS = 5  # of a source


@cache
def starts(source: str) -> list[World]:
    """Starts of a suite."""
    found = []
    for scenario in suite(source, episodes=STARTS, first_seed=3000).scenarios[:STARTS]:
        env = make(scenario, observation="state")
        env.reset(seed=scenario.seed)
        found.append(env.world)
        env.close()
    return found


@cache
def barn(folder: Path) -> list[World]:
    """Each tenth world of BARN."""
    return [case.world for case in islice(barn_cases(folder, jackal()), 0, None, 10)]


@cache
def maps(path: Path) -> list[World]:
    """Random starts and goals on a map; those of a mask are refused."""
    return [case.world for case in nav2_cases(path, STARTS, 0)]


def planning(name: str, limit: float) -> Callable[[World, np.random.Generator], float]:
    """A call of a planner; returns the CPU time that it took [s]."""
    planner = make_planner(name)

    def call(world: World, rng: np.random.Generator) -> float:
        began = time.thread_time()
        planner.plan(world, stop=CpuDeadline(limit), rng=rng)
        return time.thread_time() - began

    return call


def deciding(name: str, limit: float) -> Callable[[World, np.random.Generator], float]:
    """The first decision of a policy."""

    def call(world: World, rng: np.random.Generator) -> float:
        policy = make_policy(name)
        policy.reset(world, rng)
        policy.plan_with(ImmediateExecutor(CpuDeadline(limit)))
        began = time.thread_time()
        policy.act(world, None)
        return time.thread_time() - began

    return call


def overruns(
    call: Callable[[World, np.random.Generator], float],
    sources: dict[str, Callable[[], list[World]]],
    calls: int,
    limit: float,
) -> Iterator[tuple[float, str]]:
    """Overrun [s] of each call, and its source; those that it refuses are left out."""
    fit = {}
    for name, worlds in sources.items():
        try:
            call(worlds()[0], np.random.default_rng(0))  # what a process does once
            fit[name] = worlds()
        except PushplanError:
            continue
    names = list(fit)
    for number in range(calls if names else 0):
        name = names[number % len(names)]
        worlds = fit[name]
        world = worlds[number // len(names) % len(worlds)]
        try:
            took = call(world, np.random.default_rng(number))
        except PushplanError:  # a suite may mix tasks
            continue
        yield max(0.0, took - limit), f"{name}, call {number}"


def main() -> None:
    """A row for each planner and policy, and each limit."""
    parser = command_line(__doc__)
    known = (*MAZE, *SHIP, *DECIDING)
    parser.add_argument("calls", nargs="?", type=int, default=10_000, help="default 10000")
    parser.add_argument("--names", nargs="+", default=list(known), choices=known)
    parser.add_argument("--sources", nargs="+", help="only these suites, barn and maps")
    parser.add_argument("--barn", type=Path, metavar="FOLDER", help="of worlds.npz and paths.npz")
    parser.add_argument("--nav2", type=Path, metavar="FOLDER", help="of .yaml files of maps")
    parser.add_argument("--busy", type=int, default=1, help="processes that compute; default 1")
    options = parser.parse_args()
    sources: dict[str, Callable[[], list[World]]] = {}
    for name in suite_names():
        sources[name] = lambda name=name: starts(name)
    if options.barn:
        sources["barn"] = lambda: barn(options.barn)
    for path in sorted(options.nav2.glob("*.yaml")) if options.nav2 else ():
        sources[path.stem] = lambda path=path: maps(path)
    for name in set(options.sources or ()) - set(sources):
        parser.error(f"no source {name!r}; choose from {', '.join(sources)}")
    if options.sources:
        sources = {name: sources[name] for name in options.sources}
    atexit.register(gc.unfreeze)  # or OMPL's binding complains at the end
    write(origin(), "")
    head("call", "limit [ms]", "calls", "overrun p99 [ms]", "p99.9", "worst", "which")
    with busy(options.busy):
        for name in options.names:
            for limit in LIMITS_S:
                make_call = deciding if name in DECIDING else planning
                gc.collect()
                gc.freeze()
                found = list(overruns(make_call(name, limit), sources, options.calls, limit))
                over = [1e3 * seconds for seconds, _ in found]
                worst = max(found)[1] if found else ""
                numbers = percentiles(over, (99, 99.9, 100)) if found else [""] * 3
                row(f"`{name}`", f"{1e3 * limit:g}", len(found), *numbers, worst)


if __name__ == "__main__":
    main()
