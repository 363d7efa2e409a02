"""Times of two trees of pushplan against each other, in turns, and if their results are the same.

    python -m benchmarks.speed.paired --old CHECKOUT [--old-python PYTHON] [--only PATTERN]

Two processes, of this tree and of an older one, do the same work one after the other, first the
one and then the other. Times are processor time of the process; work and its results are those of
`benchmarks/speed/paired_worker.py`. A ratio is new over old: the geometric mean of the pairs with
its 95 % bootstrap interval. An older tree that is installed in an environment of its own, as a
compiled core needs, is run by ``--old-python``.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.reporting import command_line, head, origin, row, write
from benchmarks.speed import paired_worker
from pushplan.evaluation.statistics.estimates import bootstrap_interval

SHORTEST = 0.05
"""CPU time of a turn [s] of the faster tree: quick calls are repeated within a turn."""
SLOWER = 1.05
"""Ratio from which on a tree is slower."""
ONE_THREAD = {
    f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA", "TORCH")
}


@dataclass(frozen=True)
class Answer:
    """CPU time of a call [s], and a digest of its result."""

    seconds: float
    digest: str


class FailedError(Exception):
    """A workload that a tree cannot run."""


class Side:
    """A process that runs workloads in one tree.

    Args:
        process: runs `benchmarks/speed/paired_worker.py`.
        name: of the tree in messages.
    """

    def __init__(self, process: subprocess.Popen[str], name: str) -> None:
        self.process = process
        self.name = name

    def run(self, workload: str, calls: int) -> Answer:
        """Run a workload so many times in a row."""
        assert self.process.stdin is not None and self.process.stdout is not None
        print(json.dumps([workload, calls]), file=self.process.stdin, flush=True)
        line = self.process.stdout.readline()
        if not line:
            sys.exit(f"the process of the {self.name} tree has ended, see above")
        answer = json.loads(line)
        if "error" in answer:
            raise FailedError(f"{self.name} tree: {answer['error']}")
        return Answer(**answer)


@contextmanager
def side(name: str, tree: Path, python: str | None, installed: bool) -> Iterator[Side]:
    """Start the process of a tree.

    Args:
        name: in messages.
        tree: top folder of a checkout.
        python: interpreter; this one if None.
        installed: whether the tree is what is installed for the interpreter.
    """
    folders = [str(tree), *filter(None, [os.environ.get("PYTHONPATH")])]
    command = [python or sys.executable, "-P", paired_worker.__file__, str(tree)]
    process = subprocess.Popen(
        command + ([] if installed else ["--not-installed"]),
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(folders)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        yield Side(process, name)


@dataclass(frozen=True)
class Comparison:
    """Times of one workload.

    Args:
        old, new: (N,) CPU time of a call in each turn [s].
        same: whether all results had the same bytes.
    """

    old: np.ndarray
    new: np.ndarray
    same: bool

    @property
    def ratio(self) -> float:
        """Geometric mean of new over old."""
        return float(np.exp(np.log(self.new / self.old).mean()))

    @property
    def interval(self) -> tuple[float, float]:
        """95 % bootstrap interval of the ratio."""
        low, high = bootstrap_interval(np.log(self.new / self.old))
        return float(np.exp(low)), float(np.exp(high))


def compare(old: Side, new: Side, workload: str, repeats: int) -> Comparison:
    """Run a workload in two trees in turns: old and new, new and old, and so on.

    Raises:
        FailedError: if a tree cannot run it.
    """
    for one in (old, new):
        one.run(workload, 1)
    fastest = min(one.run(workload, 1).seconds for one in (old, new))
    calls = max(1, round(SHORTEST / max(fastest, 1e-6)))
    answers: dict[Side, list[Answer]] = {old: [], new: []}
    for turn in range(repeats):
        for one in (old, new) if turn % 2 == 0 else (new, old):
            answers[one].append(one.run(workload, calls))
    seconds = [np.array([answer.seconds for answer in answers[one]]) for one in (old, new)]
    digests = {answer.digest for one in (old, new) for answer in answers[one]}
    return Comparison(*seconds, same=len(digests) == 1)


def table(old: Side, new: Side, workloads: Sequence[str], repeats: int) -> None:
    """Print a row for each workload, and what they come to."""
    head("workload", "old [ms]", "new [ms]", "new / old", "95 %", "same result")
    ratios = []
    slower = []
    for workload in workloads:
        try:
            found = compare(old, new, workload, repeats)
        except FailedError as error:
            row(workload, str(error), "", "", "", "")
            continue
        low, high = found.interval
        row(
            workload,
            *(f"{1e3 * np.median(seconds):.2f}" for seconds in (found.old, found.new)),
            f"{found.ratio:.2f}",
            f"{low:.2f} to {high:.2f}",
            "yes" if found.same else "**no**",
        )
        ratios.append(found.ratio)
        if high > SLOWER:
            slower.append(workload)
    if ratios:
        write("", f"Median of {len(ratios)} ratios: {np.median(ratios):.2f}.")
        write(f"Intervals that reach above {SLOWER}: {', '.join(slower) or 'none'}.")


def options() -> Namespace:
    """Read the command line."""
    parser = command_line(__doc__)
    parser.add_argument("--old", type=Path, required=True, help="top folder of the older tree")
    parser.add_argument("--old-python", help="interpreter for which the older tree is installed")
    parser.add_argument("--repeats", type=int, default=16, help="pairs; default 16")
    parser.add_argument("--only", default="", help="workloads whose names match this expression")
    return parser.parse_args()


def main() -> None:
    """Print the table."""
    given = options()
    tree = Path(__file__).parents[2]
    workloads = [name for name in paired_worker.WORKLOADS if re.search(given.only, name)]
    with (
        side("old", given.old.resolve(), given.old_python, given.old_python is not None) as old,
        side("new", tree, None, True) as new,
    ):
        write(origin(), "")
        table(old, new, workloads, given.repeats)


if __name__ == "__main__":
    main()
