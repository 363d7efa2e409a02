"""Every policy on every suite: are the scores those of another version, to the last digit?

    python -m benchmarks.scores.regression FOLDER [--episodes 10] [--suites A,B] [--policies A,B]
    python -m benchmarks.scores.regression FOLDER --against OTHER_FOLDER

The first runs each policy on each suite that it is made for, into one run folder each; what is
there already is not run again. The second compares the rows of two such folders, times aside, and
prints every row that differs, column by column. Run the first with each of the two versions.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from benchmarks.reporting import command_line
from pushplan.evaluation import bench
from pushplan.evaluation.run.policy_specs import policy_names
from pushplan.scenarios import suite_names
from pushplan.world import InvalidInputError

KEY = ("policy", "scenario", "seed")


def run(folder: Path, suites: list[str], policies: list[str], episodes: int, workers: int) -> None:
    """Run what is not there yet; a line for each pair of suite and policy."""
    for suite in suites:
        for policy in policies:
            out = folder / f"{suite}__{policy}"
            if (out / "results.csv").exists():
                continue
            try:
                results = bench(
                    suite, [policy], episodes=episodes, workers=workers, out=out, timeout_s=900.0
                )
            except InvalidInputError as error:
                print(f"{suite} {policy}: not run, {error}", flush=True)
            else:
                print(f"{suite} {policy}: {len(results.rows)} episodes", flush=True)


def rows_of(folder: Path) -> dict[tuple[str, ...], dict[str, str]]:
    """All rows below a folder."""
    found = {}
    for file in sorted(folder.glob("*__*/results.csv")):
        with file.open() as stream:
            for row in csv.DictReader(stream):
                found[tuple(row[name] for name in KEY)] = row
    return found


def is_time(column: str) -> bool:
    """Whether a column depends on the machine."""
    return column.endswith("_s") and column != "sim_time_s"


def compare(folder: Path, other: Path) -> int:
    """Print what differs; the number of rows that do."""
    here, there = rows_of(folder), rows_of(other)
    common = sorted(here.keys() & there.keys())
    differing = 0
    for key in common:
        columns = [name for name in here[key] if name in there[key] and not is_time(name)]
        changed = [name for name in columns if here[key][name] != there[key][name]]
        if changed:
            differing += 1
            words = (f"{name} {there[key][name]} -> {here[key][name]}" for name in changed)
            print(" ".join(key), *words, sep="\n    ")
    print(f"{len(common) - differing} rows equal, {differing} differ; only in {folder}: "
          f"{len(here) - len(common)}, only in {other}: {len(there) - len(common)}")  # fmt: skip
    return differing


def main() -> None:
    """Run or compare."""
    parser = command_line(__doc__, episodes=10, workers=2)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--against", type=Path)
    every = ",".join(name for name in suite_names() if name != "smoke")
    parser.add_argument("--suites", default=every)
    parser.add_argument("--policies", default=",".join(policy_names()))
    given = parser.parse_args()
    if given.against is not None:
        sys.exit(compare(given.folder, given.against) > 0)
    suites, policies = given.suites.split(","), given.policies.split(",")
    run(given.folder, suites, policies, given.episodes, given.workers)


if __name__ == "__main__":
    main()
