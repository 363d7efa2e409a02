"""Time to a first plan on large maps and among many objects.

    python -m benchmarks.speed.large_maps [CALLS] [--planner NAME] [--case NAME]
    python -m benchmarks.speed.large_maps [CALLS] --figure docs/images/large-maps.png

CPU time of a call that ends with its first plan, or without one after a second of CPU time. "new
map" is the first call on a map that no planner has seen; "same map" are later calls from and to
other places. "after 1 s" is the cost of the plan after that second over that of the first, on new
maps. The offices are those of the suites, from seed 100 on.
"""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from multiprocessing import get_context

import numpy as np
import shapely

from benchmarks.first_plan import CpuDeadline, timed_plan
from benchmarks.reporting import command_line, head, origin, row, write
from pushplan.drawing.figure import COLUMN, DPI, STYLE
from pushplan.drawing.palette import DASHES, MARKERS
from pushplan.envs import make
from pushplan.scenarios import suite
from pushplan.scenarios.office import start_and_goal
from pushplan.world import (
    FirstSolution,
    GoalDisc,
    Movables,
    StaticMap,
    World,
    jackal,
)
from pushplan.world.checks import BoolArray, FloatArray

PLANNERS = ("straight", "kinodynamic-rrt", "push-aware", "skeleton", "geometric-rrt")
PATIENCE = CpuDeadline(1.0)
SAME = 3  # later calls on a map
LAST = ("after 1 s: cost", "peak memory [MB]")
ROBOT = jackal(drive="differential")
MakeMap = Callable[[np.random.Generator], StaticMap]


def posts(count: int, rng: np.random.Generator) -> StaticMap:
    """Convex polygons of 0.2 to 0.6 m, 2.1 m apart on average, on a square floor."""
    side = 2.1 * float(np.sqrt(count))
    found = []
    for place in rng.uniform(0.0, side, (count, 2)):
        corners = np.sort(rng.uniform(0.0, 2.0 * np.pi, 7))
        outline = rng.uniform(0.1, 0.3) * np.column_stack([np.cos(corners), np.sin(corners)])
        hull = shapely.MultiPoint(place + outline).convex_hull
        found.append(np.asarray(hull.exterior.coords)[:-1])
    return StaticMap.build(found, bounds=[0.0, 0.0, side, side])


def office_grid(cells: int, room: int, rng: np.random.Generator) -> BoolArray:
    """Rooms of ``room`` cells with a door of a fifth of a wall in each wall, and desks."""
    grid = np.zeros((cells, cells), dtype=np.bool_)
    grid[::room] = grid[:, ::room] = grid[-1] = grid[:, -1] = True
    door = max(2, room // 5)
    for r in range(0, cells - room + 1, room):
        for c in range(0, cells - room + 1, room):
            down, across = rng.integers(2, room - door - 1, 2)
            if r:
                grid[r, c + across : c + across + door] = False
            if c:
                grid[r + down : r + down + door, c] = False
            if rng.random() < 0.5:
                a, b = rng.integers(door + 1, room - door - 1, 2)
                grid[r + a, c + b : c + b + door] = True
    return grid


def office(cells: int, rng: np.random.Generator) -> StaticMap:
    """An office of rooms of 5 m as a grid of ``cells`` cells of 0.5 m."""
    return StaticMap.from_occupancy(office_grid(round(cells**0.5), 10, rng), 0.5)


def office_squares(count: int, rng: np.random.Generator) -> StaticMap:
    """The same with cells of 0.25 m, ``count`` occupied ones, each of them a polygon."""
    grid = office_grid(round((count / 0.11) ** 0.5), 20, rng)
    places = 0.25 * np.argwhere(grid)[:, ::-1]
    square = 0.25 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    return StaticMap.build(list(places[:, None] + square))


def free_place(static: StaticMap, rng: np.random.Generator) -> FloatArray:
    """A place 0.5 m or more from everything, well inside."""
    tree = shapely.STRtree([shapely.Polygon(part) for part in static.convex_parts])
    low = static.bounds[:2] + 1.0
    high = static.bounds[2:] - 1.0
    while True:
        place: FloatArray = rng.uniform(low, high)
        if not len(tree.query(shapely.Point(place).buffer(0.5), predicate="intersects")):
            return place


def scatter(static: StaticMap, count: int, rng: np.random.Generator) -> Movables:
    """Boxes of 0.3 to 0.5 m."""
    boxes = []
    for _ in range(count):
        turn = rng.uniform(0.0, np.pi)
        half = rng.uniform(0.15, 0.25)
        ends = turn + np.pi * np.array([0.25, 0.75, 1.25, 1.75])
        outline = half * 2.0**0.5 * np.column_stack([np.cos(ends), np.sin(ends)])
        boxes.append(free_place(static, rng) + outline)
    return Movables.from_polygons(boxes, density=10.0)


def hall(rng: np.random.Generator, side: float = 40.0) -> StaticMap:
    """A square hall with 16 columns."""
    at = (np.arange(4) + 0.5) / 4.0 * side
    column = 0.3 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    columns = [column + np.array([x, y]) for x in at for y in at]
    return StaticMap.build(columns, bounds=[0.0, 0.0, side, side])


def worlds(make_map: MakeMap, objects: int, seed: int) -> Iterator[World]:
    """Scenes on one map: from one random place to another, half a map away or farther."""
    rng = np.random.default_rng(seed)
    static = make_map(rng)
    side = float(static.bounds[2:].min())
    movables = scatter(static, objects, rng)
    while True:
        start = free_place(static, rng)
        end = free_place(static, rng)
        if np.hypot(*(end - start)) < 0.5 * side:
            continue
        near = np.hypot(*(movables.poses[:, :2] - start).T) < 1.0
        yield World(
            robot=ROBOT,
            robot_pose=np.array([*start, rng.uniform(-np.pi, np.pi)]),
            static=static,
            movables=movables.select(~near),
            goal=GoalDisc(end, 0.5),
        )


def office_worlds(name: str, seed: int) -> Iterator[World]:
    """The scene of a suite, and others between other places of the same office."""
    env = make(suite(name, episodes=1, first_seed=100 + seed).scenarios[0], observation="state")
    env.reset()
    world = env.world
    rng = np.random.default_rng(seed)
    while True:
        yield world
        start, end = start_and_goal(rng, world.static, world.movables, world.robot)
        world = replace(world, robot_pose=start, goal=GoalDisc(end, 0.25))


@dataclass(frozen=True)
class Measured:
    """Times of a planner in one case, infinite without a plan."""

    new: FloatArray  # CPU time of first calls on a map [s]
    same: FloatArray  # of later calls
    ratio: float  # median cost of plans after a second over that of the first plans
    peak_mb: float  # memory of a process that does nothing else


def measure(name: str, scenes: Callable[[int], Iterator[World]], maps: int) -> Measured:
    """Plan on new maps, three more times on each, and then on the first scene for a second."""
    small = next(worlds(partial(posts, 50), 5, 0))
    timed_plan(name, small, FirstSolution() | PATIENCE, 0)  # imports what it needs
    times = np.full((maps, 1 + SAME), np.inf)
    ratios = np.full(maps, np.nan)
    for seed in range(maps):
        some = list(islice(scenes(seed), 1 + SAME))
        plans = []
        for k, world in enumerate(some):
            times[seed, k], result = timed_plan(name, world, FirstSolution() | PATIENCE, seed)
            plans.append(result.plan)
        later = timed_plan(name, some[0], PATIENCE, seed)[1].plan
        if plans[0] is not None and later is not None:
            ratios[seed] = later.cost / plans[0].cost
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return Measured(times[:, 0], times[:, 1:].ravel(), float(np.nanmedian(ratios)), peak)


def measure_case(name: str, case: str, maps: int) -> Measured:
    """`measure` in a process of its own, so that its memory is that of this case."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(measure, name, CASES[case], maps).result()


def cell(times: FloatArray) -> str:
    """Median, 95th percentile and worst of times [ms], and how many calls had a plan."""
    at = np.percentile(times, [50, 95, 100], method="higher") * 1e3
    return " / ".join(f"{v:.0f}" for v in at) + f" ({np.isfinite(times).sum()} of {len(times)})"


CASES: dict[str, Callable[[int], Iterator[World]]] = {
    "2,000 polygons": partial(worlds, partial(posts, 2000), 0),
    "2,000 polygons, 20 objects": partial(worlds, partial(posts, 2000), 20),
    "office of 10,000 cells": partial(worlds, partial(office, 10_000), 0),
    "office, 10,000 square polygons": partial(worlds, partial(office_squares, 10_000), 0),
    "1,000 objects": partial(worlds, hall, 1000),
    **{name: partial(office_worlds, name) for name in ("office-1k", "office-2k", "office-5k")},
}


def draw_growth(path: str, planners: Sequence[str], calls: int) -> None:
    """Write a figure of median times on new maps, against polygons and against objects."""
    import matplotlib.pyplot as plt

    plt.rcParams.update(STYLE)
    counts = {"polygons": (125, 250, 500, 1000, 2000, 4000), "objects": (0, 125, 250, 500, 1000)}
    makers: dict[str, Callable[[int], Callable[[int], Iterator[World]]]] = {
        "polygons": lambda count: partial(worlds, partial(posts, count), 0),
        "objects": lambda count: partial(worlds, hall, count),
    }
    figure, axes = plt.subplots(
        1, 2, figsize=(2.0 * COLUMN, 2.6), layout="constrained", sharey=True
    )
    for axis, (kind, numbers) in zip(axes, counts.items(), strict=True):
        for name in planners:
            times = [measure(name, makers[kind](count), calls).new for count in numbers]
            middle = [1e3 * np.percentile(values, 50, method="higher") for values in times]
            index = planners.index(name)
            axis.plot(numbers, middle, label=name, linestyle=DASHES[index], marker=MARKERS[index])
            print(
                kind,
                name,
                [f"{count}: {value:.0f} ms" for count, value in zip(numbers, middle, strict=True)],
            )
        axis.axhline(50.0 if kind == "polygons" else 100.0, color="0.6", linestyle=":")
        axis.set(xlabel=kind, yscale="log")
    axes[0].set_ylabel("first plan, new map [ms]")
    axes[0].legend()
    figure.savefig(path, dpi=DPI)


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("calls", nargs="?", type=int, default=10)
    parser.add_argument("--planner", action="append", choices=PLANNERS)
    parser.add_argument("--case", action="append", choices=CASES)
    parser.add_argument("--figure")
    options = parser.parse_args()
    planners = options.planner or PLANNERS
    if options.figure:
        return draw_growth(options.figure, planners, options.calls)
    write(origin(), "")
    head("map", "planner", "new map: median / p95 / worst [ms]", "same map", *LAST)
    for case in options.case or CASES:
        for name in planners:
            found = measure_case(name, case, options.calls)
            cells = cell(found.new), cell(found.same), f"{found.ratio:.3f}", f"{found.peak_mb:.0f}"
            row(case, f"`{name}`", *cells)


if __name__ == "__main__":
    main()
