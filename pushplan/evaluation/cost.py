"""About how long a batch will take and how much it will store, before it begins."""

from __future__ import annotations

import shutil
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pushplan.evaluation.database import DATABASE
from pushplan.evaluation.jobs import Job
from pushplan.evaluation.rows import setting_of
from pushplan.evaluation.store import open_results

EPISODE_BYTES = 20_000
"""A recorded episode in a maze or a small room (measured: 18 to 26 kB); larger scenes have more."""
_MEASURED = 200  # recorded episodes whose mean size is taken


@dataclass(frozen=True)
class Cost:
    """What a batch is expected to cost.

    Attributes:
        jobs: all of them.
        new: those without a result.
        seconds: what the new ones take [s], by the stored episodes; None where there are none.
        most_s: what they take if each uses its whole time limit [s]; None without a limit.
        stored: episodes in the run directory.
        size: of what the new ones store [byte].
        free: what the disk has room for [byte].
    """

    jobs: int
    new: int
    seconds: float | None
    most_s: float | None
    stored: int
    size: float
    free: int


def cost_of(
    jobs: Sequence[Job],
    out: Path,
    *,
    workers: int,
    limit_s: float | None,
    traced: bool,
    retry_failed: bool = False,
    any_version: bool = False,
) -> Cost:
    """The cost of jobs that are `identified`, in a run directory that may be there already.

    A job is expected to take the mean of its policy in its setting, else of its policy, else of
    all stored episodes.
    """
    rows = open_results(out)[0] if (out / DATABASE).is_file() else []
    kept = [row for row in rows if not (retry_failed and row.failed)]
    done = {row.job for row in kept}
    keys = {(row.policy, row.scenario, row.seed) for row in kept if any_version}
    new = [job for job in jobs if job.id not in done and job.key not in keys]
    times: dict[Hashable, list[float]] = {}
    for row in rows:
        for key in ((row.policy, row.setting), row.policy, None):
            times.setdefault(key, []).append(row.wall_time_s or 0.0)
    means = {key: float(np.mean(found)) for key, found in times.items()}
    seconds = None
    if rows or not new:
        every = means.get(None, 0.0)
        seconds = sum(
            means.get(
                (job.policy.label, setting_of(*job.key[1:])), means.get(job.policy.label, every)
            )
            for job in new
        )
    files = list((out / "episodes").glob("*.npz"))[:_MEASURED]
    size = float(np.mean([file.stat().st_size for file in files])) if files else EPISODE_BYTES
    there = next(one for one in (out.absolute(), *out.absolute().parents) if one.exists())
    abreast = max(1, min(workers, len(new)))
    return Cost(
        jobs=len(jobs),
        new=len(new),
        seconds=None if seconds is None else seconds / abreast,
        most_s=None if limit_s is None else limit_s * len(new) / abreast,
        stored=len(rows),
        size=size * len(new) if traced else 0.0,
        free=shutil.disk_usage(there).free,
    )
