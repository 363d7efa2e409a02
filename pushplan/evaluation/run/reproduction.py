"""Run stored jobs again and compare what comes out with what was stored."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pushplan.errors import describe
from pushplan.evaluation.run.batch import run_batch
from pushplan.evaluation.run.job_identity import differences, job_of, job_spec
from pushplan.evaluation.store.database import read_results, reading
from pushplan.evaluation.store.rows import TIMING_COLUMNS, ResultRow, columns
from pushplan.world import Episode, InvalidInputError, PushplanError, SchemaError

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
    (stored,) = found
    try:
        again, settings = job_of(stored.spec)
    except PushplanError:
        raise
    except Exception as error:  # a stranger may have written it
        raise SchemaError(f"job {job} of {path} is none: {describe(error)}") from error
    with tempfile.TemporaryDirectory(prefix="pushplan-") as folder:
        (row,) = run_batch([again], out=folder, workers=1, settings=settings)
        names = [name for name in columns() if name not in (*TIMING_COLUMNS, "job")]
        differing = [name for name in names if getattr(row, name) != getattr(stored.row, name)]
        differing += _differing_parts(_episode(Path(path), stored.row), _episode(Path(folder), row))
    changed = differences(stored.spec, job_spec(again, settings))
    return Reproduction(stored.row, row, tuple(differing), changed)


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
