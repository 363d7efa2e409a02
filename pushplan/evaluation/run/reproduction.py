"""Run stored jobs again and compare what comes out with what was stored."""

from __future__ import annotations

import math
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.errors import describe
from pushplan.evaluation.run.batch import Progress, run_batch
from pushplan.evaluation.run.job_identity import differences, job_of, job_spec
from pushplan.evaluation.run.jobs import Job, JobSettings
from pushplan.evaluation.store.database import StoredResult, read_results, reading
from pushplan.evaluation.store.rows import TIMING_COLUMNS, ResultRow
from pushplan.world import Episode, InvalidInputError, PushplanError, SchemaError
from pushplan.world.checks import integer, number

FRACTION = 0.05
"""Of a run's jobs that `verify` runs again."""
_TIMES = ("act_times_s", "plan_times_s")
_ARRAYS = ("times", "robot_poses", "object_poses", "completed", "actions", "rewards")


@dataclass(frozen=True)
class Reproduction:
    """Comparison of a stored result with a second run of its job.

    Attributes:
        stored: the row in the run directory.
        again: the row of now.
        differing: columns, and arrays of the recorded episode, whose bytes differ; times aside.
        changed: what has changed since, in words: versions, the policy's file; empty if nothing.
    """

    stored: ResultRow
    again: ResultRow
    differing: tuple[str, ...]
    changed: str

    @property
    def same(self) -> bool:
        """True if row and episode are the same to the byte, times aside."""
        return not self.differing

    @property
    def how(self) -> str:
        """Names of all that differs, with both values of a column."""
        old = self.stored.by_column()
        new = self.again.by_column()
        shown = {name: f" {old[name]!r} -> {new[name]!r}" for name in old}
        return ", ".join(name + shown.get(name, "") for name in self.differing)


@dataclass(frozen=True)
class Verification:
    """A sample of a run directory's jobs, run again.

    Attributes:
        checked: the comparisons, one for each job of the sample.
        jobs: results in the run directory.
        left_out: results that cannot be made again, and are in no sample.
        why: the reason for the last of these; empty if there is none.
    """

    checked: tuple[Reproduction, ...]
    jobs: int
    left_out: int
    why: str

    @property
    def differing(self) -> tuple[Reproduction, ...]:
        """Those that came out differently."""
        return tuple(one for one in self.checked if not one.same)


def reproduce(path: str | Path, job: str) -> Reproduction:
    """Run a job of a run directory again, in a process of its own.

    Args:
        path: run directory; it is only read.
        job: what the column ``job`` says, or its beginning.

    Raises:
        InvalidInputError: if there is no such job or more than one, or its policy, scenario or
            environment was given as a Python object.
        SchemaError: if the stored episode cannot be read.
        UnknownNameError: if there is no such policy any more.
    """
    with reading(path) as db:
        found = [one for one in read_results(db) if one.row.job.startswith(job)]
    if not job or len(found) != 1:
        few = ", ".join(one.row.job[:12] for one in found[:3])
        raise InvalidInputError(
            f"job {job!r} must be the beginning of one job of {path} (column 'job' of "
            f"results.csv), it is that of {len(found)}{f': {few}' if few and job else ''}"
        )
    return _run_again(path, [(found[0], *_job_of(path, found[0]))], workers=1)[0]


def verify(
    path: str | Path,
    *,
    fraction: float = FRACTION,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Verification:
    """Run a random sample of the jobs of a run directory again, policies in turn, and compare.

    Args:
        path: run directory; it is only read.
        fraction: of the results that count, in (0, 1]; at least one job.
        seed: of the sample.
        workers: processes, all cores by default.
        progress: told of every row.

    Raises:
        InvalidInputError: if none of the jobs can be made again, or a number is out of range.
        SchemaError: if a stored episode cannot be read.
    """
    fraction = number("fraction", fraction, low=0.0, high=1.0, open_low=True)
    rng = np.random.default_rng(integer("seed", seed, low=0))
    with reading(path) as db:
        stored = [one for one in read_results(db) if one.current]
    known = []
    why = "there is no result yet"
    for one in stored:
        try:
            known.append((one, *_job_of(path, one)))
        except PushplanError as error:
            why = str(error)
    if not known:
        raise InvalidInputError(f"nothing of {path} can be run again: {why}")
    count = max(1, math.ceil(fraction * len(known) - 1e-9))
    rounds: Counter[str] = Counter()
    drawn: list[tuple[int, int, int]] = []
    for k in rng.permutation(len(known)).tolist():  # all policies before the second of one
        policy = known[k][0].row.policy
        drawn.append((rounds[policy], len(drawn), k))
        rounds[policy] += 1
    chosen = [known[k] for *_, k in sorted(drawn)[:count]]
    checked = _run_again(path, chosen, workers=workers, progress=progress)
    left_out = len(stored) - len(known)
    return Verification(tuple(checked), len(stored), left_out, why if left_out else "")


def _job_of(path: str | Path, stored: StoredResult) -> tuple[Job, JobSettings]:
    try:
        job, settings = job_of(stored.spec)
        for name, value in job.scenario.variations.items():
            if name.endswith("_file") and value is not None and not Path(value).is_file():
                raise InvalidInputError(f"{name} {value} of job {stored.row.job} is missing")
        return job, settings
    except PushplanError:
        raise
    except Exception as error:  # a stranger may have written it
        raise SchemaError(f"job {stored.row.job} of {path} is none: {describe(error)}") from error


def _run_again(
    path: str | Path,
    chosen: Sequence[tuple[StoredResult, Job, JobSettings]],
    **options: Any,
) -> list[Reproduction]:
    """Run jobs in processes of their own, those with the same settings together."""
    found = []
    for settings in dict.fromkeys(one for _, _, one in chosen):
        group = [(stored, job) for stored, job, one in chosen if one == settings]
        with tempfile.TemporaryDirectory(prefix="pushplan-") as folder:
            jobs = [job for _, job in group]
            rows = run_batch(jobs, out=folder, settings=settings, **options)
            by_key = {(row.policy, row.scenario, row.seed): row for row in rows}
            for stored, job in group:
                row = by_key[job.key]
                changed = differences(stored.spec, job_spec(job, settings))
                differing = _differing(Path(path), stored.row, Path(folder), row)
                found.append(Reproduction(stored.row, row, tuple(differing), changed))
    return found


def _differing(path: Path, stored: ResultRow, folder: Path, again: ResultRow) -> list[str]:
    aside = (*TIMING_COLUMNS, "job", "trace")
    new = again.by_column()
    old = stored.by_column().items()
    found = [name for name, value in old if name not in aside and value != new[name]]
    first = _episode(path, stored)
    if first is None and not stored.failed:  # the run has kept no episode
        return found
    return found + _differing_parts(first, _episode(folder, again))


def _episode(path: Path, row: ResultRow) -> Episode | None:
    if row.trace_file is None:
        return None
    return Episode.load(path / row.trace_file)


def _differing_parts(first: Episode | None, second: Episode | None) -> list[str]:
    if first is None or second is None:
        return [] if first is second else ["episode"]
    same = {}
    for name in _ARRAYS:
        one = getattr(first, name)
        two = getattr(second, name)
        same[name] = np.array_equal(one, two, equal_nan=True)
    for name in _TIMES:  # times of the wall clock are never the same, but as many
        same[name] = len(getattr(first, name)) == len(getattr(second, name))
    same["plans"] = first.plans == second.plans
    same["about"] = dict(first.about) == dict(second.about)
    return [name for name, equal in same.items() if not equal]
