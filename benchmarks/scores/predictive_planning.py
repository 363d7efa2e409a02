"""The predictive ship planners side by side: ``python -m benchmarks.scores.predictive_planning``.

One plan on each field of Ship-Ice 2D, 9 m to the goal line, without a stop rule. CPU time is what
the call costs on a quiet machine; wall time is what it took beside whatever else was running. The
path of each plan is then driven exactly in the simulator, from the same start: its length and the
work that it does, without tracking and replanning, are the planner's own. The simulator is their
judge, not the model that some of them plan with.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from benchmarks.reporting import command_line
from pushplan.envs import RolloutInteraction
from pushplan.envs.simulators.base import Materials
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.planners import make_planner
from pushplan.world import Planner, World, stream

NAMES = (
    "straight",
    "ship-lattice-published",
    "ship-predictive-published",
    "ship-predictive",
    "ship-predictive-network",
)


def judged(planner: Planner, world: World, materials: Materials) -> tuple[float, ...]:
    """CPU and wall time of a call [ms], iterations, length of the path [m], work on it [kg m]."""
    cpu = time.process_time()
    wall = time.perf_counter()
    result = planner.plan(world)
    cpu = time.process_time() - cpu
    wall = time.perf_counter() - wall
    assert result.plan is not None, result.status
    work = RolloutInteraction(materials=materials).sweep(world, result.plan.poses).work
    return 1e3 * cpu, 1e3 * wall, float(result.stats.iterations), result.plan.length, work


def main() -> None:
    """One row for each concentration and planner."""
    parser = command_line(__doc__)
    parser.add_argument("--fields", type=int, default=20)
    parser.add_argument("--planners", nargs="*", choices=NAMES, default=list(NAMES))
    options = parser.parse_args()
    sys.stdout.write(
        "| ice | planner | CPU median [ms] | CPU p95 | wall median | iterations "
        "| mean length [m] | mean work [kg m] |\n|---|---|---|---|---|---|---|---|\n"
    )
    for share in (0.1, 0.2, 0.3, 0.4, 0.5):
        task = ShipIceTask(variations={"concentration": share})
        worlds = [task.start(stream(seed, "layout")) for seed in range(options.fields)]
        for name in options.planners:
            planner = make_planner(name)
            rows = np.array([judged(planner, world, task.materials) for world in worlds])
            cpu, wall, iterations = np.median(rows[:, :3], axis=0)
            slow = np.percentile(rows[:, 0], 95)
            length, work = rows[:, 3:].mean(axis=0)
            sys.stdout.write(
                f"| {100 * share:.0f} % | `{name}` | {cpu:.0f} | {slow:.0f} | {wall:.0f} "
                f"| {iterations:.0f} | {length:.2f} | {work:.3g} |\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
