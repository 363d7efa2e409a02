"""One policy on the variations of the maze that the suites leave out.

    python -m benchmarks.scores.maze_variations [POLICY] [--seeds 20]

Z-shape, crowds, wheeled boxes, random starts, testbed dimensions, wheel-speed actions.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.reporting import command_line
from pushplan.envs import make
from pushplan.evaluation import run_episode
from pushplan.metrics import navigation_scores
from pushplan.planners import make_policy
from pushplan.scenarios import Scenario
from pushplan.world import LogsPlans

CASES: tuple[tuple[str, str, dict[str, object]], ...] = (
    ("benchmark", "turn_rate", {"shape": "z", "boxes": 10}),
    ("benchmark", "turn_rate", {"shape": "u", "boxes": 20}),
    ("benchmark", "turn_rate", {"shape": "u", "boxes": 10, "wheeled": 1.0}),
    ("benchmark", "turn_rate", {"shape": "u", "boxes": 5, "random_start": True}),
    ("benchmark", "wheels", {"shape": "u", "boxes": 5}),
    ("testbed", "turn_rate", {"shape": "u", "boxes": 6}),
    ("testbed", "turn_rate", {"shape": "z", "boxes": 10}),
    ("testbed", "wheels", {"shape": "u", "boxes": 6}),
)


def main() -> None:
    parser = command_line(__doc__, seeds=20)
    parser.add_argument("policy", nargs="?", default="kinodynamic-rrt")
    given = parser.parse_args()
    name = given.policy
    seeds = given.seeds
    for preset, action, variations in CASES:
        rows = []
        failures = []
        began = time.perf_counter()
        for seed in range(seeds):
            scenario = Scenario("maze", preset=preset, variations=variations, seed=seed)
            env = make(scenario, observation="state", action=action)
            policy = make_policy(name)
            episode = run_episode(env, policy, scenario)
            scores = navigation_scores(episode)
            plans = len(policy.plan_log) if isinstance(policy, LogsPlans) else 0
            rows.append((scores.success, scores.efficiency, scores.effort, plans))
            if not episode.success:
                failures.append(f"{seed}: {episode.reason}")
        success, efficiency, effort, plans_mean = np.mean(rows, axis=0)
        each = (time.perf_counter() - began) / seeds
        print(
            f"{preset} {action} {variations}: success {success:.2f}, E_nav {efficiency:.3f}, "
            f"I_nav {effort:.3f}, {plans_mean:.1f} plans, {each:.2f} s an episode",
            *failures,
            sep="\n    failed seed ",
        )


if __name__ == "__main__":
    main()
