"""How well planning calls keep their stop rules, and whether they keep memory.

    python -m benchmarks.speed.deadlines [CALLS] [--planners NAME ...]
    python -m benchmarks.speed.deadlines --worlds [CALLS] [--planners NAME ...]
    python -m benchmarks.speed.deadlines --posts POSTS [CALLS] [--planners NAME ...]
    python -m benchmarks.speed.deadlines --offices POLYGONS [CALLS] [--planners NAME ...]
    python -m benchmarks.speed.deadlines --growth [CALLS] [--planners NAME ...] [--controllers]

The first calls every planner CALLS times with a deadline of 50 ms on ten starts of its task and
writes when the calls returned. The wall clock also runs while the machine does something else:
*own* is the CPU time that a call used after it had last looked at the clock before the deadline,
an upper bound of its lateness on a machine of its own. *gc* is the longest time that Python's
garbage collector took within a call.

The second calls every planner once in each of CALLS random worlds, each with another robot and
another map of which nothing is prepared, and writes the CPU time of the calls. The deadline is one
of CPU time too, so that what else the machine does changes nothing.

The third and the fourth do the same in halls of so many posts, and in furnished offices of about
so many polygons, on each of which four calls are made.

The fifth calls every planner CALLS times on a small start with a budget of a few iterations, and
the controllers as often along a path, and writes how memory grows after the first tenth of the
calls: the pages of the process, and what is in use of the heap of the C library, which compiled
code and libraries allocate from (where that can be asked, as in glibc); then a hundredth of the
calls are repeated under tracemalloc, which sees what Python and NumPy allocate.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import os
import sys
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from benchmarks.first_plan import CpuDeadline
from benchmarks.reporting import command_line
from pushplan.control import MpcTracker, PathFollower
from pushplan.envs import make
from pushplan.planners import make_planner
from pushplan.scenarios import Scenario, generate_office
from pushplan.scenarios.office import start_and_goal
from pushplan.world import (
    Controller,
    Deadline,
    GoalDisc,
    MaxIterations,
    Movables,
    Planner,
    StopCheck,
    World,
    turtlebot3_burger,
)
from pushplan.world.checks import FloatArray

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "planners"))
from random_worlds import posts, random_world

BUDGET_S = 0.05
_FIRST = 30  # worlds before those that are measured, for what a process does once
MAZE = ("straight", "geometric-rrt", "kinodynamic-rrt", "push-aware", "namo")
SHIP = (
    "skeleton",
    "ship-lattice",
    "ship-lattice-quick",
    "ship-lattice-published",
    "ship-predictive",
    "ship-predictive-network",
    "ship-predictive-published",
)
CONTROLLERS: dict[str, Callable[[], Controller]] = {
    "PathFollower": PathFollower,
    "MpcTracker": MpcTracker,
}


def starts(name: str, count: int, *, small: bool = False) -> list[World]:
    """Starts of the task that a planner is made for: ten boxes, or ice of 10, 30 and 50 %."""
    found = []
    for seed in range(count):
        variations: dict[str, bool | int | float | str]
        if name in MAZE:
            variations = {"boxes": 1 if small else 10}
            scenario = Scenario("maze", "pymunk", "benchmark", variations, seed)
        else:
            variations = {"concentration": 0.1 if small else (0.1, 0.3, 0.5)[seed % 3]}
            scenario = Scenario("ship_ice", "pymunk", "benchmark", variations, seed)
        env = make(scenario, observation="state")
        env.reset(seed=seed)
        found.append(_nearest(env.world, 6) if small and name in SHIP else env.world)
    return found


def _nearest(world: World, count: int) -> World:
    """The world with only the floes that lie nearest to the ship."""
    floes = world.movables
    away = np.hypot(*(floes.poses[:, :2] - world.robot_pose[:2]).T)
    kept = np.sort(np.argsort(away, kind="stable")[:count])
    outlines = [floes.vertices[floes.offsets[k] : floes.offsets[k + 1]] for k in kept]
    return replace(world, movables=Movables.from_outlines(outlines, floes.poses[kept]))


@dataclass(frozen=True)
class Watched(Deadline):
    """A deadline that notes the CPU time at the last look before it."""

    seen: list[float] = field(default_factory=list)

    def start(self) -> StopCheck:
        """Arm the rule; the start of the call counts as a look."""
        end = time.perf_counter() + self.budget_s
        self.seen[:] = [time.thread_time()]

        def check(iterations: int, cost: float) -> bool:
            if time.perf_counter() >= end:
                return True
            self.seen[0] = time.thread_time()
            return False

        return check


class Collections:
    """Time that the garbage collector takes."""

    def __init__(self) -> None:
        self.seconds = self._began = 0.0
        gc.callbacks.append(self._note)

    def _note(self, phase: str, info: dict[str, int]) -> None:
        if phase == "start":
            self._began = time.thread_time()
        else:
            self.seconds += time.thread_time() - self._began


def lateness(planner: Planner, worlds: list[World], calls: int) -> FloatArray:
    """(calls, 3) wall time, own time after the last look, time in the collector [ms]."""
    rows = np.empty((calls, 3))
    stop = Watched(BUDGET_S)
    collections = Collections()
    for call in range(calls):
        rng = np.random.default_rng(call)
        before = collections.seconds
        began = time.perf_counter()
        planner.plan(worlds[call % len(worlds)], stop=stop, rng=rng)
        wall = time.perf_counter() - began
        own = time.thread_time() - stop.seen[0] if wall >= BUDGET_S else 0.0
        rows[call] = wall, own, collections.seconds - before
    gc.callbacks.remove(collections._note)
    return 1e3 * rows


def deadlines(names: list[str], calls: int) -> None:
    """One row for each planner."""
    write(f"Deadline {1e3 * BUDGET_S:.0f} ms, {calls} calls a planner [ms]", "")
    write(
        "| planner | median | p95 | p99 | p99.9 | worst | own p99.9 | own worst | gc worst |",
        "|---|---|---|---|---|---|---|---|---|",
    )
    for name in names:
        planner = make_planner(name)
        worlds = starts(name, 10)
        for world in worlds:
            planner.plan(world, stop=Deadline(BUDGET_S), rng=np.random.default_rng(0))
        gc.collect()
        gc.freeze()  # as a controller does after its start
        atexit.register(gc.unfreeze)
        wall, own, collector = lateness(planner, worlds, calls).T
        numbers = [*np.percentile(wall, [50, 95, 99, 99.9, 100])]
        numbers += [*np.percentile(own, [99.9, 100]), collector.max()]
        write(f"| `{name}` | " + " | ".join(f"{value:.1f}" for value in numbers) + " |")


@lru_cache(maxsize=1)
def office(polygons: int, seed: int) -> World:
    """A furnished office."""
    return generate_office(
        np.random.default_rng(seed), robot=turtlebot3_burger(), polygons=polygons
    )


def office_world(polygons: int, seed: int, name: str) -> World:
    """An office, the same for four seeds in a row, with a start and a goal of its own."""
    world = office(polygons, seed // 4)
    rng = np.random.default_rng(seed)
    start, end = start_and_goal(rng, world.static, world.movables, world.robot)
    return replace(world, robot_pose=start, goal=GoalDisc(end, 0.25))


def any_world(
    names: list[str], calls: int, worlds: str, world_of: Callable[[int, str], World]
) -> None:
    """One row for each planner: CPU time of calls in worlds that were never seen.

    Args:
        names: the planners.
        calls: number of worlds.
        worlds: what to call them.
        world_of: makes the one of a seed, for a planner.
    """
    write(f"CPU time with a deadline of {1e3 * BUDGET_S:.0f} ms, {calls} {worlds} [ms]", "")
    write("| planner | p50 | p99 | p99.9 | worst | over 65 ms |", "|---|---|---|---|---|---|")
    for name in names:
        planner = make_planner(name)
        took = np.empty(calls)
        for seed in range(-min(_FIRST, calls), calls):
            rng = np.random.default_rng(abs(seed))
            world = world_of(seed % 2**32, name)
            began = time.thread_time()
            planner.plan(world, stop=CpuDeadline(BUDGET_S), rng=rng)
            if seed >= 0:
                took[seed] = 1e3 * (time.thread_time() - began)
            elif seed == -1:
                gc.collect()
                gc.freeze()
        numbers = " | ".join(f"{v:.1f}" for v in np.percentile(took, [50, 99, 99.9, 100]))
        write(f"| `{name}` | {numbers} | {(took > 65.0).sum()} |")


def resident() -> float:
    """Memory of this process [kB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1024.0


class _Mallinfo2(ctypes.Structure):
    """What glibc says of its heap, see mallinfo(3) [bytes]."""

    _fields_ = tuple(
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    )


def heap_in_use() -> float:
    """Bytes that the C library has handed out and not got back; NaN where it does not say."""
    try:
        ask = ctypes.CDLL(None).mallinfo2
    except (AttributeError, OSError):
        return float("nan")
    ask.restype = _Mallinfo2
    answer = ask()
    return float(answer.uordblks + answer.hblkhd)


def growth(name: str, call: Callable[[int], object], calls: int) -> None:
    """Write a row: time of a call, memory after a tenth of the calls and at the end, growth."""
    marks = []
    heap = []
    began = time.perf_counter()
    for number in range(calls):
        if number in (calls // 10, calls // 2):
            gc.collect()
            marks.append(resident())
            heap.append(heap_in_use())
        call(number)
    each = 1e3 * (time.perf_counter() - began) / calls
    gc.collect()
    marks.append(resident())
    heap.append(heap_in_use())
    few = max(calls // 100, 20)
    tracemalloc.start()
    for number in range(few):
        call(number)
    gc.collect()
    first = tracemalloc.get_traced_memory()[0]
    for number in range(few):
        call(number)
    gc.collect()
    traced = (tracemalloc.get_traced_memory()[0] - first) / few
    tracemalloc.stop()
    write(
        f"| `{name}` | {each:.2f} | "
        + " | ".join(f"{mark / 1024.0:.1f}" for mark in marks)
        + f" | {1024.0 * (marks[-1] - marks[0]) / (0.9 * calls):.1f}"
        f" | {(heap[-1] - heap[0]) / (0.9 * calls):.1f} | {traced:.1f} |"
    )


def memory(names: list[str], calls: int, controllers: bool) -> None:
    """One row for each planner and controller."""
    write(f"{calls} calls each", "")
    write(
        "| | ms a call | MB after a tenth | MB after half | MB at the end "
        "| bytes a call | of the heap | traced |",
        "|---|---|---|---|---|---|---|---|",
    )
    stop = MaxIterations(20)
    for name in names:
        planner = make_planner(name)
        worlds = starts(name, 5, small=True)

        def call(number: int, planner: Planner = planner, worlds: list[World] = worlds) -> object:
            rng = np.random.default_rng(number)
            return planner.plan(worlds[number % len(worlds)], stop=stop, rng=rng)

        growth(name, call, calls)
    world = starts("ship-predictive", 1, small=True)[0]
    plan = make_planner("ship-predictive").plan(world).plan
    assert plan is not None
    for name in CONTROLLERS if controllers else ():
        controller = CONTROLLERS[name]()

        def command(number: int, controller: Controller = controller) -> object:
            step = number % 200
            if step == 0:
                controller.reset(world)
            along = plan.poses[step % len(plan.poses)]
            return controller.command(world.moved(time=0.1 * step, robot_pose=along), plan)

        growth(name, command, calls)


def write(*lines: str) -> None:
    """Print lines at once, so that a long run can be watched."""
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


def main() -> None:
    """Deadlines, or growth."""
    parser = command_line(__doc__)
    known = (*MAZE, *SHIP)
    parser.add_argument("calls", nargs="?", type=int, help="default: 10000, with --growth 100000")
    parser.add_argument("--worlds", action="store_true", help="random worlds instead of tasks")
    parser.add_argument("--posts", type=int, default=0, help="halls of so many posts instead")
    parser.add_argument("--offices", type=int, default=0, help="offices of so many polygons")
    parser.add_argument("--planners", nargs="*", choices=known, default=list(known))
    parser.add_argument("--growth", action="store_true", help="memory instead of deadlines")
    parser.add_argument("--controllers", action="store_true", help="with --growth: them as well")
    options = parser.parse_args()
    if options.calls is not None and options.calls < 10:
        parser.error(f"calls must be at least 10, got {options.calls}")
    calls = options.calls or 10_000
    if options.offices:
        office_of = partial(office_world, options.offices)
        any_world(options.planners, calls, f"offices of {options.offices} polygons", office_of)
    elif options.posts:
        hall_of = partial(posts, options.posts)
        any_world(options.planners, calls, f"halls of {options.posts} posts", hall_of)
    elif options.worlds:
        any_world(options.planners, calls, "random worlds", random_world)
    elif options.growth:
        memory(options.planners, options.calls or 100_000, options.controllers)
    else:
        deadlines(options.planners, calls)


if __name__ == "__main__":
    main()
