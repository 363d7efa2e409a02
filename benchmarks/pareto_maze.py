"""The front of (E_nav, I_nav) in the maze, drawn by sweeping the price of pushing.

    python benchmarks/pareto_maze.py [SEEDS] [BOXES] [PICTURE]

Closed-loop episodes of the 2D benchmark preset, U-shape, from seed 1000 on: `push-aware` and
`kinodynamic-rrt` with the same prices w.
"""

from __future__ import annotations

import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib import pyplot as plt

from pushplan.control import PathFollower
from pushplan.envs import make
from pushplan.evaluation import run_episode
from pushplan.metrics import navigation_scores
from pushplan.planners.kinodynamic import KinodynamicRRT, KinodynamicRRTConfig
from pushplan.planners.policies import push_aware
from pushplan.planners.policy import PlanFollower
from pushplan.planners.push_aware import PushAware, PushAwareConfig, cautious_model
from pushplan.scenarios import Scenario

WEIGHTS = (0.5, 1.0, 2.0, 5.0)
FIRST_SEED = 1000


def policy(name: str, weight: float) -> PlanFollower:
    """A policy with this price of pushing."""
    if name == "push-aware":
        return push_aware(PushAware(PushAwareConfig(push_weight=weight), cautious_model()))
    return PlanFollower(KinodynamicRRT(KinodynamicRRTConfig(push_weight=weight)), PathFollower())


def point(name: str, weight: float, boxes: int, seeds: int) -> tuple[float, float, float]:
    """Mean success, E_nav and I_nav."""
    rows = []
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        scenario = Scenario("maze", variations={"shape": "u", "boxes": boxes}, seed=seed)
        env = make(scenario, observation="state")
        scores = navigation_scores(run_episode(env, policy(name, weight), scenario))
        rows.append((float(scores.success), scores.efficiency, scores.effort))
    success, efficiency, effort = np.mean(rows, axis=0)
    return float(success), float(efficiency), float(effort)


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    boxes = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    picture = sys.argv[3] if len(sys.argv) > 3 else "pareto-maze.png"
    figure, axes = plt.subplots(figsize=(4.2, 3.2), dpi=90, layout="constrained")
    for name, style in (("push-aware", "o-"), ("kinodynamic-rrt", "s--")):
        front = []
        for weight in WEIGHTS:
            success, efficiency, effort = point(name, weight, boxes, seeds)
            front.append((efficiency, effort))
            print(
                f"{name:16s} w {weight:4.1f}: success {success:.2f}, "
                f"E_nav {efficiency:.3f}, I_nav {effort:.3f}",
                flush=True,
            )
        axes.plot(*np.array(front).T, style, label=name, markersize=4)
        for weight, at in zip(WEIGHTS, front, strict=True):
            axes.annotate(f"{weight:g}", at, fontsize=7, textcoords="offset points", xytext=(3, 3))
    axes.set(xlabel="E_nav", ylabel="I_nav", title=f"maze, U, {boxes} boxes, {seeds} seeds; by w")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
    figure.savefig(picture)


if __name__ == "__main__":
    main()
