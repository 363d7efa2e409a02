"""The front of (E_nav, I_nav) in the maze, drawn by sweeping the weight of pushing.

Usage::

    python -m benchmarks.scores.pareto_maze [--episodes 50] [--boxes 10] [--weights 0.5,1,2.5,5,10]

Closed-loop episodes of the 2D benchmark preset, U-shape, with the turn rate at constant speed:
`push-aware-constant-speed` and `kinodynamic-rrt` with the same weights w. Prints a table in
Markdown and writes a picture.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib import pyplot as plt

from benchmarks.reporting import command_line
from pushplan.drawing.figure import COLUMN, DPI, STYLE
from pushplan.drawing.palette import DASHES, MARKERS
from pushplan.evaluation import PolicySpec, bench, bootstrap_interval
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.push_aware import PushAware, PushAwareConfig, cautious_model
from pushplan.planners.push_aware.policies import push_aware_constant_speed
from pushplan.planners.rrt import KinodynamicRRT, KinodynamicRRTConfig

NAMES = ("push-aware-constant-speed", "kinodynamic-rrt")


def policy(name: str, weight: float) -> PlanFollower:
    """A policy with this weight of pushing."""
    if name == "kinodynamic-rrt":
        return PlanFollower(KinodynamicRRT(KinodynamicRRTConfig(push_weight=weight)))
    return push_aware_constant_speed(
        PushAware(PushAwareConfig(push_weight=weight), cautious_model())
    )


def spec(name: str, weight: float) -> PolicySpec:
    """The same for the worker processes."""
    source = f"{Path(__file__).resolve()}:policy"
    return PolicySpec(f"{name}-{weight:g}", source, {"name": name, "weight": weight})


def main() -> None:
    """Run the sweep, print the table and draw the picture."""
    parser = command_line(__doc__, episodes=50, seed=0, workers=2)
    parser.add_argument("--boxes", type=int, default=10, choices=(3, 5, 6, 10))
    parser.add_argument("--weights", default="0.5,1,2.5,5,10")
    parser.add_argument("--picture", default="docs/images/pareto-maze.png")
    options = parser.parse_args()
    weights = [float(text) for text in options.weights.split(",")]
    specs = [spec(name, weight) for name in NAMES for weight in weights]
    suite = f"maze-2d-{options.boxes}"
    rows = bench(
        suite, specs, episodes=options.episodes, seed=options.seed, workers=options.workers
    ).rows
    plt.rcParams.update(STYLE)
    figure, axes = plt.subplots(figsize=(COLUMN, 2.6), layout="constrained")
    sys.stdout.write("| policy | w | success | E_nav | I_nav |\n|---|---|---|---|---|\n")
    for name, marker, dashes in zip(NAMES, MARKERS, DASHES, strict=False):
        front = []
        for weight in weights:
            mine = [row for row in rows if row.policy == spec(name, weight).label]
            efficiency = [float(row.E_nav or 0.0) for row in mine]
            effort = [1.0 if row.I_nav is None else float(row.I_nav) for row in mine]
            front.append((np.mean(efficiency), np.mean(effort)))
            cells = [
                "{:.3f} [{:.3f}, {:.3f}]".format(np.mean(values), *bootstrap_interval(values))
                for values in (efficiency, effort)
            ]
            success = np.mean([row.success for row in mine])
            sys.stdout.write(f"| `{name}` | {weight:g} | {success:.2f} | {' | '.join(cells)} |\n")
        axes.plot(*np.array(front).T, label=name, marker=marker, linestyle=dashes, markersize=4)
        for weight, at in zip(weights, front, strict=True):
            axes.annotate(f"{weight:g}", at, fontsize=7, textcoords="offset points", xytext=(3, 3))
    axes.set(xlabel="E_nav", ylabel="I_nav", title=f"{suite}, {options.episodes} episodes, by w")
    axes.legend()
    axes.grid(alpha=0.3)
    figure.savefig(options.picture, dpi=DPI)


if __name__ == "__main__":
    main()
