"""How much the control rate and the greatest turn rate matter: S, E and I in each combination.

    python -m benchmarks.scores.execution [--suites A,B] [--policies A,B] [--periods 0.02,0.2]
        [--turn-rates 0.05,0.5] [--episodes 20] [--seed 0] [--workers 2] [--out FOLDER]

The suites are those of pushplan with two variations, ``control_step`` and ``max_turn_rate``. How
long an episode may take goes with the robot: `TaskVariations`. "Default" is the suite as it is. S
is the fraction of the objects that are done, or of the episodes in which the robot gets there. A
folder makes a run that was stopped go on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from benchmarks.reporting import command_line
from pushplan.envs.registry import goal_kind
from pushplan.evaluation import bench
from pushplan.evaluation.report.results import Results
from pushplan.evaluation.store.rows import Status
from pushplan.scenarios import suite
from pushplan.scenarios.scenario import Variations

SUITES = (
    "area-clearing-2d-10,box-delivery-2d-small-columns-10,area-clearing-3d-10,box-delivery-3d-5"
)
POLICIES = "greedy,gtsp-mpc"
PERIODS, TURN_RATES = "0.01,0.02,0.05,0.1,0.2", "0.05,0.1,0.25,0.5,1.5"


def cells(periods: str, turn_rates: str) -> Iterator[dict[str, float]]:
    """The default, and then every combination."""
    yield {}
    for period in periods.split(",") if periods else ():
        for rate in turn_rates.split(",") if turn_rates else ("",):
            found = {"control_step": float(period)}
            yield found | ({"max_turn_rate": float(rate)} if rate else {})


COLUMNS = {"objects": ("S_manip", "E_manip", "I_manip"), "robot": ("success", "E_nav", "I_nav")}


def mean(results: Results, column: str) -> float:
    """Mean of a column over all episodes; a failed one counts as zero."""
    values = [getattr(row, column) for row in results.rows]
    return sum(value or 0.0 for value in values) / len(values)


def main() -> None:
    """Print a table for each suite and policy."""
    parser = command_line(__doc__, episodes=20, seed=0, workers=2)
    parser.add_argument("--suites", default=SUITES)
    parser.add_argument("--policies", default=POLICIES)
    parser.add_argument("--periods", default=PERIODS)
    parser.add_argument("--turn-rates", default=TURN_RATES)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    for name in options.suites.split(","):
        scenarios = suite(name, episodes=options.episodes, first_seed=options.seed).scenarios
        columns = COLUMNS[str(goal_kind(scenarios[0].task))]
        for policy in options.policies.split(","):
            print(f"\n{name}, {policy}, seeds {options.seed} to "
                  f"{options.seed + options.episodes - 1}\n")  # fmt: skip
            print("| period [s] | turn rate [rad/s] | S | E | I | failed |")
            print("|---|---|---|---|---|---|")
            for cell in cells(options.periods, options.turn_rates):
                changed = [
                    replace(one, variations=Variations({**one.variations, **cell}))
                    for one in scenarios
                ]
                words = "-".join(f"{value:g}" for value in cell.values()) or "default"
                out = options.out and options.out / f"{name}__{policy}__{words}"
                results = bench(
                    changed,
                    [policy],
                    workers=options.workers,
                    out=out,
                    timeout_s=None,
                    observation="state",
                )
                figures = " | ".join(f"{mean(results, c):.3f}" for c in columns)
                failed = sum(row.status != Status.DONE for row in results.rows)
                where = " | ".join(
                    str(cell.get(key, "default")) for key in ("control_step", "max_turn_rate")
                )
                print(f"| {where} | {figures} | {failed} |", flush=True)


if __name__ == "__main__":
    main()
