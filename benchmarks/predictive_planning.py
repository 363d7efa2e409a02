"""Times of the predictive ship planners: ``python benchmarks/predictive_planning.py``.

The first plan of an episode, 9 m goal line, without a stop rule. CPU time is what the call costs
on a quiet machine; wall time is what it took beside whatever else was running.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.planners import make_planner, warm_up
from pushplan.world import stream

NAMES = ("ship-predictive", "ship-predictive-network")


def main() -> None:
    """One row for each concentration and planner."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=20)
    options = parser.parse_args()
    warm_up(*NAMES)
    sys.stdout.write("| ice | planner | CPU median [ms] | wall median [ms] | pieces predicted |\n")
    sys.stdout.write("|---|---|---|---|---|\n")
    for share in (0.1, 0.2, 0.3, 0.4, 0.5):
        task = ShipIceTask(variations={"concentration": share})
        worlds = [task.start(stream(seed, "layout")) for seed in range(options.fields)]
        for name in NAMES:
            planner = make_planner(name)
            rows = []
            for world in worlds:
                cpu, wall = time.process_time(), time.perf_counter()
                result = planner.plan(world)
                rows.append(
                    (
                        1e3 * (time.process_time() - cpu),
                        1e3 * (time.perf_counter() - wall),
                        result.stats.iterations,
                    )
                )
            median = np.median(rows, axis=0)
            sys.stdout.write(
                f"| {100 * share:.0f} % | {name} | {median[0]:.0f} | {median[1]:.0f} "
                f"| {median[2]:.0f} |\n"
            )


if __name__ == "__main__":
    main()
