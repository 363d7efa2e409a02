"""The work of ship planners in a run, beside the published planner and straight ahead.

    pushplan experiment benchmarks/experiments/ship_work.yaml --out runs/ship-work
    python -m benchmarks.scores.ship_work runs/ship-work

Means with 95 % bootstrap intervals. The ratio of work to that of `ship-lattice-published` is the
ratio of the means, resampled in pairs. No work at all counts as less than straight, also where
straight ahead has none either.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.reporting import command_line, head, row
from pushplan.evaluation import ResultRow, Results
from pushplan.evaluation.statistics.estimates import estimate
from pushplan.world import stream

BASE = "ship-lattice-published"
FLOOR = "straight"


def main() -> None:
    """Print a table of the run."""
    parser = command_line(__doc__)
    parser.add_argument("run", help="a run directory")
    results = Results.load(parser.parse_args().run)
    columns = ("success", "E_nav", "I_nav", "work", "work / published", "less than straight")
    head("ice", "policy", *columns)
    for setting in dict.fromkeys(one.setting for one in results.rows):
        rows = [one for one in results.rows if one.setting == setting]
        for name in results.policies:
            row(setting, f"`{name}`", *quality(rows, name))


def quality(rows: Sequence[ResultRow], name: str) -> list[str]:
    """The cells of one policy."""
    mine = {row.seed: row for row in rows if row.policy == name}
    done = [row for row in mine.values() if not row.failed]
    share = sum(row.success for row in mine.values()) / len(mine)
    if not done:
        return [f"{share:.2f}", "", "", "", "", ""]
    cells = [f"{share:.2f}"]
    for score in ("E_nav", "I_nav", "interaction_work_kg_m"):
        found = estimate([getattr(row, score) for row in done])
        numbers = [figure(value) for value in (found.mean, found.low, found.high)]
        cells.append(f"{numbers[0]} ({numbers[1]}-{numbers[2]})")
    works = {
        other: {row.seed: row.interaction_work_kg_m for row in rows if row.policy == other}
        for other in (BASE, FLOOR, name)
    }
    cells.append(ratio(works[name], works[BASE]))
    pairs = paired(works[name], works[FLOOR] if name != FLOOR else {})
    better = (pairs[:, 0] < pairs[:, 1]) | (pairs.max(axis=1, initial=0.0) == 0.0)
    cells.append(f"{int(better.sum())} of {len(pairs)}" if len(pairs) else "")
    return cells


def figure(value: float) -> str:
    """A number with three digits after the point, or three significant ones."""
    return f"{value:.3f}" if value < 1.0 else f"{value:.3g}"


def paired(first: dict[int, float | None], second: dict[int, float | None]) -> np.ndarray:
    """(N, 2) values of the seeds that both have."""
    both = [(first[seed], second[seed]) for seed in first if second.get(seed) is not None]
    return np.array([pair for pair in both if pair[0] is not None], dtype=float).reshape(-1, 2)


def ratio(first: dict[int, float | None], second: dict[int, float | None]) -> str:
    """Ratio of the means, with the interval of a bootstrap over pairs."""
    pairs = paired(first, second)
    if len(pairs) == 0 or pairs[:, 1].mean() == 0.0:
        return ""
    drawn = stream(0, "bootstrap").integers(0, len(pairs), (9999, len(pairs)))
    means = pairs[drawn].mean(axis=1)
    low, high = np.quantile(means[:, 0] / np.maximum(means[:, 1], 1e-12), [0.025, 0.975])
    return f"{pairs[:, 0].mean() / pairs[:, 1].mean():.2f} ({low:.2f}-{high:.2f})"


if __name__ == "__main__":
    main()
