"""What the first use of a policy costs: a process of its own imports it, and makes a decision.

    python -m benchmarks.speed.startup [--policies NAME ...] [--seed SEED]

A line gives medians of five processes: CPU time of ``import``, of the first plan of a planner or
else the first ``act``, and of the whole process, which also reads the world from a file, and the
most memory that the process had. The world is a start of a suite of the policy's task.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.reporting import command_line, head, row
from pushplan.evaluation import JobSettings
from pushplan.planners import make_policy
from pushplan.scenarios import suite
from pushplan.world import save_world

SUITES = {
    "straight": "maze-2d-5",
    "kinodynamic-rrt": "maze-2d-5",
    "push-aware": "maze-2d-5",
    "greedy": "area-clearing-2d-10",
    "gtsp-mpc": "area-clearing-2d-10",
    "ship-lattice": "ship-ice-2d-20",
    "ship-predictive": "ship-ice-2d-20",
}
_PROCESSES = 5
_SCRIPT = """
import json, resource, sys, time
began = time.process_time()
from pushplan.planners import make_policy
policy = make_policy(sys.argv[1])
imported = time.process_time()
import numpy as np
from pushplan.world import load_world
world = load_world(sys.argv[2])
read = time.process_time()
policy.reset(world, np.random.default_rng(0))
if hasattr(policy, "planner"):
    from pushplan.world import FirstSolution
    assert policy.planner.plan(world, stop=FirstSolution()).plan is not None
else:
    policy.act(world)
decided = time.process_time()
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
print(json.dumps([imported - began, decided - read, decided, memory]))
"""


def measure(policy: str, seed: int) -> np.ndarray:
    """CPU time of import, of the first decision and of the process [s], and memory [MB]."""
    (scenario,) = suite(SUITES[policy], episodes=1, first_seed=seed).scenarios
    env = JobSettings().environment(scenario, make_policy(policy))
    env.reset(seed=seed)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "world.json")
        save_world(env.world, path)
        command = [sys.executable, "-c", _SCRIPT, policy, str(path)]
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": ""}  # as pip leaves a package
        for _ in range(1 + _PROCESSES):
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, check=True
            )
            found.append(json.loads(done.stdout))
    return np.median(found[1:], axis=0)


def main() -> None:
    """Measure, print the table."""
    parser = command_line(__doc__, seed=1000)
    parser.add_argument("--policies", nargs="+", default=list(SUITES), choices=list(SUITES))
    options = parser.parse_args()
    head("policy", "import [s of CPU]", "first plan or decision [s]", "process [s]", "memory [MB]")
    for policy in options.policies:
        imported, decided, whole, memory = measure(policy, options.seed)
        row(policy, f"{imported:.2f}", f"{decided:.2f}", f"{whole:.2f}", f"{memory:.0f}")


if __name__ == "__main__":
    main()
