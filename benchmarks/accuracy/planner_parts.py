"""What each part of the planner of paths is worth: plans without it, against plans with all.

    python -m benchmarks.accuracy.planner_parts [--scenes 30] [--seed 9500] [--cpu 0.3]

In each kind of world it prints, for the whole planner with other random numbers and for the planner
without each part in turn: starts without a plan, by how much plans cost more than those of the
whole planner with the standard error, and the CPU time to the first plan, median and worst.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from benchmarks.reporting import command_line, write
from pushplan.core import navigation as core
from pushplan.envs import make
from pushplan.motion.path_planner import core_world
from pushplan.scenarios import suite
from pushplan.world import GoalDisc, Movables, StaticMap, World, box_delivery_robot

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
SHAPES = ("constant_speed", "differential", "car", "omnidirectional")
NEVER = 1e300


def starts(name: str, count: int, seed: int) -> Iterator[World]:
    """The starts of a suite."""
    for scenario in suite(name, episodes=count, first_seed=seed).scenarios:
        env = make(scenario, observation="state")
        env.reset(seed=scenario.seed)
        yield env.world


def driven(world: World, drive: str) -> World:
    """The same start of a robot with another drive; all but ships may go back."""
    robot = world.robot
    radius = 1.2 * robot.circumscribed_radius if drive == "car" else 0.0
    back = 0.0 if drive == "constant_speed" else -0.5 * robot.max_speed
    made = replace(robot, drive=drive, min_speed=back, min_turning_radius=radius)
    return replace(world, robot=made)


def turned(world: World) -> World:
    """A robot that faces the other way."""
    x, y, theta = world.robot_pose.tolist()
    return driven(world.moved(robot_pose=(x, y, theta + math.pi)), "differential")


def in_dead_end(world: World) -> World:
    """A robot that faces the end of a corridor in which it cannot turn."""
    size = world.robot.circumscribed_radius
    x, y = world.robot_pose[:2].tolist()
    sides = [SQUARE * [6 * size, 0.2] + [x, y + s * 1.3 * size] for s in (-1.0, 1.0)]
    end = SQUARE * [0.2, 2.6 * size] + [x + 1.6 * size, y]
    low, high = np.array([x, y]) - 9 * size, np.array([x, y]) + 9 * size
    static = StaticMap.build((*sides, end), bounds=(*low, *high))
    goal = GoalDisc((x + 6 * size, y + 3 * size), size)
    here = replace(world, static=static, movables=Movables.empty(), goal=goal)
    return driven(here.moved(robot_pose=(x, y, 0.0)), "differential")


def among_a_crowd(world: World) -> World:
    """Boxes that overlap on the whole way of a robot, and that no wall holds."""
    rng = np.random.default_rng(int(1e6 * abs(float(world.robot_pose[0]))))
    static = StaticMap.build(segments=[[0, 0, 9, 0], [0, 5, 9, 5]], radii=0.05, bounds=[0, 0, 9, 5])
    places = rng.uniform([1.8, 1.2, -3.0], [5.5, 3.8, 3.0], (24, 3))
    boxes = Movables.from_outlines([0.3 * SQUARE] * 24, places, density=10.0)
    return World(box_delivery_robot(), [0.6, 2.5, 0.0], static, boxes, GoalDisc([6.0, 2.5], 0.2))


KINDS: dict[str, tuple[str, Callable[[World], World]]] = {
    **{f"maze-2d-10 {d}": ("maze-2d-10", lambda w, d=d: driven(w, d)) for d in SHAPES},
    "office-1k": ("office-1k", lambda world: world),
    "turned about": ("maze-2d-5", turned),
    "dead end": ("maze-2d-5", in_dead_end),
    "crowd": ("maze-2d-5", among_a_crowd),
}


def plan(world: World, search: str, without: int, seed: int, cpu: float) -> tuple[float, float]:
    """Cost of a plan [kg m] after a CPU time, and CPU time to the first one [s]."""
    options = core.PlannerOptions()
    options.search = core.SearchKind[search]
    options.seed = seed
    options.without = without
    began = time.process_time()
    planner = core.PathPlanner(core_world(world.for_planning()), options)
    first = math.inf
    while not planner.done and time.process_time() - began < cpu:
        planner.run()
        if first == math.inf and planner.cost < NEVER:
            first = time.process_time() - began
    best = planner.best()
    if best.status != core.PlanStatus.SOLVED:
        return math.inf, math.inf
    cost = best.travel_cost + options.push_weight * best.interaction_cost
    return cost, min(first, time.process_time() - began)


def row(name: str, found: list[tuple[float, float]], whole: list[tuple[float, float]]) -> str:
    """A row of the table."""
    pairs = zip(found, whole, strict=True)
    more = [math.log(a / b) for (a, _), (b, _) in pairs if 0.0 < b < NEVER and a < NEVER]
    first = [1e3 * time for _, time in found if time < math.inf] or [math.nan]
    error = float(np.std(more)) / math.sqrt(max(len(more), 1))
    none = sum(not cost < NEVER for cost, _ in found)
    return (
        f"{name:16s} {none:4d} {100 * float(np.mean(more or [math.nan])):+8.2f} +- "
        f"{100 * error:5.2f} {np.median(first):9.2f} {max(first):8.2f}"
    )


def main() -> None:
    parser = command_line(__doc__, scenes=30, seed=9500)
    parser.add_argument("--cpu", type=float, default=0.3, help="of a call [s]")
    parser.add_argument("--kinds", nargs="*", choices=KINDS, default=list(KINDS))
    parser.add_argument("--search", choices=("kinodynamic", "push_aware"), default="push_aware")
    options = parser.parse_args()
    for kind in options.kinds:
        name, change = KINDS[kind]
        worlds = [change(world) for world in starts(name, options.scenes, options.seed)]

        def every(
            without: int, more: int = 0, worlds: list[World] = worlds
        ) -> list[tuple[float, float]]:
            seeds = range(more, more + len(worlds))
            calls = zip(worlds, seeds, strict=True)
            return [plan(w, options.search, without, seed, options.cpu) for w, seed in calls]

        whole = every(0)
        write(f"{kind}, {len(worlds)} starts: without, no plan, cost %, first plan ms and worst")
        write(row("nothing", whole, whole), row("other seeds", every(0, 10_000), whole))
        for part, member in core.Part.__members__.items():
            write(row(part, every(int(member.value)), whole))


if __name__ == "__main__":
    main()
