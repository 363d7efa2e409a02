"""Manipulation: scores of policies on the suites that have a goal for the objects.

Usage::

    python -m benchmarks.scores.manipulation [--episodes 50] [--workers 2] [--only area-clearing-2d]
        [--policies greedy,gtsp,gtsp-mpc] [--with mpc=false,work_weight=40] [--seed 0]
        [--out runs/manipulation]
    python -m benchmarks.scores.manipulation --figure docs/images/gtsp-mpc.png

Prints one row of a Markdown table for each suite and policy: means with bootstrap intervals of
95 %, the fraction of episodes with everything done, the paired difference to the first policy, and
the longest decision of an episode: the median over the episodes, and the longest of all. With
``--with`` `gtsp-mpc` also runs once with each of these settings in place of its own, which is an
ablation: ``--policies gtsp-mpc --with mpc=false``. Below the table it names each episode in which
something was left undone. With ``--out`` the episodes are kept, a folder for each suite, and a run
that was interrupted goes on. With ``--figure`` it only draws what `gtsp-mpc` plans first in some
scenes.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from yaml import safe_load

from benchmarks.reporting import command_line
from pushplan.drawing import Panel, draw_figure, save_figure
from pushplan.envs import make
from pushplan.evaluation import PolicySpec, ResultRow, bench
from pushplan.planners.rearrangement import GtspMpc
from pushplan.scenarios import suite, suite_names

SCORES = ("S_manip", "E_manip", "I_manip")
PICTURED = ("area-clearing-2d-10", "box-delivery-2d-small-columns-10")
_DRAWS = 2000


def main() -> None:
    """Run the suites and print the table."""
    parser = command_line(__doc__, episodes=50, workers=2, seed=0)
    parser.add_argument("--only", default="", help="a suite, or all whose names hold this text")
    parser.add_argument("--policies", default="greedy,gtsp,gtsp-mpc")
    parser.add_argument("--with", dest="ablations", default="", help="settings of gtsp-mpc to try")
    parser.add_argument("--figure", default="", help="draw planned orders to this file instead")
    parser.add_argument("--out", default="", help="keep the episodes in this folder")
    options = parser.parse_args()
    if options.figure:
        figure(options.figure, options.seed)
        return
    specs = [PolicySpec(name, name) for name in options.policies.split(",")]
    for given in filter(None, options.ablations.split(",")):
        field, _, value = given.partition("=")
        specs.append(PolicySpec(f"gtsp-mpc@{field}-{value}", "gtsp-mpc", {field: safe_load(value)}))
    policies = [spec.label for spec in specs]
    columns = "suite policy episodes done S E I S-first E-first I-first decision,s".split()
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)
    failed: list[str] = []
    for name in suite_names():
        exact = options.only in suite_names()
        if name == "smoke" or (options.only != name if exact else options.only not in name):
            continue
        if suite(name, episodes=1).scenarios[0].task not in ("area_clearing", "box_delivery"):
            continue
        with tempfile.TemporaryDirectory() as folder:
            results = bench(
                name,
                policies=specs,
                episodes=options.episodes,
                workers=options.workers,
                seed=options.seed,
                out=f"{options.out}/{name}" if options.out else folder,
            )
            rows = list(results.rows)
        first = [row for row in rows if row.policy == policies[0]]
        for policy in policies:
            mine = [row for row in rows if row.policy == policy]
            print(line(name, policy, mine, first), flush=True)
            failed += [f"{name} {policy} {r.seed}: {r.reason}" for r in mine if not r.success]
    print("", *failed, sep="\n")


def line(name: str, policy: str, mine: Sequence[ResultRow], first: Sequence[ResultRow]) -> str:
    """One row of the table."""
    done = sum(row.success for row in mine) / max(1, len(mine))
    cells = [interval(values(mine, score)) for score in SCORES]
    for score in SCORES:
        other = {row.seed: getattr(row, score) for row in first}
        pairs = [
            getattr(row, score) - other[row.seed]
            for row in mine
            if getattr(row, score) is not None and other.get(row.seed) is not None
        ]
        cells.append("" if policy == first[0].policy else interval(np.array(pairs)))
    longest = values(mine, "decision_time_max_s")
    return (
        f"| `{name}` | `{policy}` | {len(mine)} | {done:.2f} | {' | '.join(cells)} "
        f"| {np.median(longest):.2f}, {longest.max():.2f} |"
    )


def figure(path: str, seed: int) -> None:
    """Draw what the policy plans first in some scenes, side by side."""
    panels = []
    for name in PICTURED:
        scenario = suite(name, episodes=1, first_seed=seed).scenarios[0]
        env = make(scenario, observation="state", action=("velocity",))
        env.reset(seed=scenario.seed)
        policy = GtspMpc()
        policy.act(env.world)
        panels.append(Panel(env.world, pushes=[push.poses for push in policy.plan], title=name))
        env.close()
    save_figure(path, draw_figure(*panels, width_in=7.0))


def values(rows: Sequence[ResultRow], score: str) -> NDArray[np.float64]:
    """A score of all episodes that have one."""
    return np.array([getattr(row, score) for row in rows if getattr(row, score) is not None])


def interval(numbers: NDArray[np.float64]) -> str:
    """Mean and bootstrap interval of 95 %."""
    if not len(numbers):
        return ""
    rng = np.random.default_rng(0)
    means = rng.choice(numbers, (_DRAWS, len(numbers))).mean(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return f"{numbers.mean():.3f} [{low:.3f}, {high:.3f}]"


if __name__ == "__main__":
    main()
