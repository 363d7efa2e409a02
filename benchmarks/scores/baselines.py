"""Measure the baselines of every suite: the scores of policies that know nothing or little.

Usage::

    python -m benchmarks.scores.baselines [--episodes 10] [--workers 2] [--only box-delivery]

`random` on every suite, `straight` where the robot has a goal, `greedy` where the objects have one.
Prints a table in Markdown: means over the episodes.
"""

from __future__ import annotations

import tempfile

from benchmarks.reporting import command_line
from pushplan.evaluation import ResultRow, bench
from pushplan.scenarios import suite, suite_names

NAVIGATION = ("maze", "ship_ice")
SCORES = ("E_nav", "I_nav", "S_manip", "E_manip", "I_manip")


def main() -> None:
    """Run the suites and print the table."""
    parser = command_line(__doc__, episodes=10, workers=2)
    parser.add_argument("--only", default="", help="suites whose name holds this text")
    options = parser.parse_args()
    print("| suite | policy | episodes | success | E | I | S |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for name in suite_names():
        if name == "smoke" or options.only not in name:
            continue
        navigates = suite(name, episodes=1).scenarios[0].task in NAVIGATION
        policies = ["random", "straight" if navigates else "greedy"]
        with tempfile.TemporaryDirectory() as folder:
            results = bench(
                name,
                policies=policies,
                episodes=options.episodes,
                workers=options.workers,
                out=folder,
            )
            rows = list(results.rows)
        for policy in policies:
            mine = [row for row in rows if row.policy == policy]
            success = sum(row.success for row in mine) / len(mine)
            cells = [mean(mine, letter) for letter in "EIS"]
            print(
                f"| `{name}` | `{policy}` | {len(mine)} | {success:.2f} | {' | '.join(cells)} |",
                flush=True,
            )


def mean(rows: list[ResultRow], letter: str) -> str:
    """Mean of the score that begins with a letter, empty where the task has none."""
    for score in SCORES:
        values = [getattr(row, score) for row in rows]
        known = [value for value in values if value is not None]
        if score.startswith(letter) and known:
            return f"{sum(known) / len(known):.3f}"
    return ""


if __name__ == "__main__":
    main()
