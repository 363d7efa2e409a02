"""Time to a first plan, quality against time, and how well a deadline is kept.

    python -m benchmarks.speed.planning_time [--scenes 100] [--calls 1000]

On scenarios of the suites maze-2d-3, -5 and -10.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.reporting import command_line
from pushplan.envs import make
from pushplan.planners import make_planner
from pushplan.planners.rrt import KinodynamicRRTConfig
from pushplan.scenarios import suite
from pushplan.world import Deadline, FirstSolution, MaxIterations, World
from pushplan.world.checks import FloatArray


def worlds(boxes: int, count: int) -> list[World]:
    """The starts of the first scenarios of a suite."""
    found = []
    for scenario in suite(f"maze-2d-{boxes}", episodes=count).scenarios:
        env = make(scenario, observation="state")
        env.reset(seed=scenario.seed)
        found.append(env.world)
    return found


def spread(values: list[float] | FloatArray, unit: str = "ms") -> str:
    """Median, 95th and 99th percentile, and the worst."""
    at = np.percentile(values, [50, 95, 99, 100])
    return "  ".join(
        f"{name} {value:8.2f} {unit}"
        for name, value in zip(("median", "p95", "p99", "worst"), at, strict=True)
    )


def first_plans(count: int) -> None:
    print("first plan that reaches the goal, one call each")
    for name in ("straight", "geometric-rrt", "kinodynamic-rrt"):
        planner = make_planner(name)
        for boxes in (3, 5, 10):
            times = []
            for seed, world in enumerate(worlds(boxes, count)):
                began = time.perf_counter()
                planner.plan(
                    world, stop=FirstSolution() | Deadline(10.0), rng=np.random.default_rng(seed)
                )
                times.append(1e3 * (time.perf_counter() - began))
            print(f"  {name:16s} {boxes:2d} boxes  {spread(times)}")


def quality(count: int) -> None:
    weight = KinodynamicRRTConfig().push_weight
    print(f"cost m0 l0 + {weight:g} sum m l [kg m] after a time, kinodynamic-rrt, 10 boxes")
    planner = make_planner("kinodynamic-rrt")
    budgets = (0.03, 0.1, 0.25, 1.0, 5.0)
    costs = np.full((count, len(budgets)), np.nan)
    for row, world in enumerate(worlds(10, count)):
        for column, budget in enumerate(budgets):
            plan = planner.plan(world, stop=Deadline(budget), rng=np.random.default_rng(row)).plan
            if plan is not None:
                costs[row, column] = plan.travel_cost + weight * plan.interaction_cost
    for column, budget in enumerate(budgets):
        have = ~np.isnan(costs[:, column])
        above = costs[have, column] / costs[have, -1] - 1.0
        print(f"  {budget:5.2f} s: {have.sum()} of {count} have a plan", end=", ")
        print(f"mean {costs[have, column].mean():.3f}", end=", ")
        print(f"above the {budgets[-1]:g} s result by median {100 * np.median(above):.2f} %")


def deadlines(calls: int) -> None:
    print(f"overrun of a 50 ms deadline, {calls} calls, 10 boxes")
    scenes = worlds(10, 20)
    for name in ("geometric-rrt", "kinodynamic-rrt"):
        planner = make_planner(name)
        planner.plan(scenes[0], stop=MaxIterations(100))
        over = []
        for call in range(calls):
            began = time.perf_counter()
            planner.plan(scenes[call % 20], stop=Deadline(0.05), rng=np.random.default_rng(call))
            over.append(1e3 * (time.perf_counter() - began - 0.05))
        print(f"  {name:16s} {spread(over)}  p99.9 {np.percentile(over, 99.9):.2f} ms")


def main() -> None:
    parser = command_line(__doc__, scenes=100)
    parser.add_argument("--calls", type=int, default=1000, help="with a deadline")
    given = parser.parse_args()
    scenes = given.scenes
    calls = given.calls
    for name in ("straight", "geometric-rrt", "kinodynamic-rrt"):
        make_planner(name).plan(worlds(3, 1)[0], stop=MaxIterations(600))
    first_plans(scenes)
    quality(min(scenes, 20))
    deadlines(calls)


if __name__ == "__main__":
    main()
