"""Every policy on every suite: are the scores those of another version, to the last digit?

    pushplan experiment benchmarks/experiments/every_policy.yaml --out RUN
    python -m benchmarks.scores.regression RUN [OTHER]

Compares the rows of a run with those of another run or CSV file, by default the stored rows, times
aside, and prints every row that differs, column by column.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from benchmarks.reporting import command_line

KEY = ("policy", "scenario", "seed")
STORED = Path(__file__).parents[1] / "reference" / "every_policy.csv"
OF_THE_RUN = {"began", "host", "job", "trace"}
"""Columns that say where and when a job ran, by which code, and how long its steps took."""


def rows_of(run: Path) -> dict[tuple[str, ...], dict[str, str]]:
    """All rows of a run directory or a CSV file."""
    with (run / "results.csv" if run.is_dir() else run).open() as stream:
        return {tuple(row[name] for name in KEY): row for row in csv.DictReader(stream)}


def is_compared(column: str) -> bool:
    """True for a column that depends neither on the machine nor on the moment."""
    is_time = column.endswith("_s") and column != "sim_time_s"
    return not is_time and column not in OF_THE_RUN


def compare(folder: Path, other: Path) -> int:
    """Print what differs; the number of rows that do."""
    here = rows_of(folder)
    there = rows_of(other)
    common = sorted(here.keys() & there.keys())
    differing = 0
    for key in common:
        columns = [name for name in here[key] if name in there[key] and is_compared(name)]
        changed = [name for name in columns if here[key][name] != there[key][name]]
        if changed:
            differing += 1
            words = (f"{name} {there[key][name]} -> {here[key][name]}" for name in changed)
            print(" ".join(key), *words, sep="\n    ")
    print(f"{len(common) - differing} rows equal, {differing} differ; only in {folder}: "
          f"{len(here) - len(common)}, only in {other}: {len(there) - len(common)}")  # fmt: skip
    return differing


def main() -> None:
    """Compare; 1 if a row differs."""
    parser = command_line(__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("other", type=Path, nargs="?", default=STORED)
    given = parser.parse_args()
    sys.exit(compare(given.run, given.other) > 0)


if __name__ == "__main__":
    main()
