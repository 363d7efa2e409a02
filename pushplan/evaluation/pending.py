"""Which jobs of a batch have no result yet."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from typing import Any

from pushplan.evaluation.database import DATABASE
from pushplan.evaluation.job_identity import (
    IdentifiedJob,
    differences,
    same_but_versions,
    settings_dict,
)
from pushplan.evaluation.jobs import Job, JobSettings
from pushplan.evaluation.rows import setting_of
from pushplan.evaluation.store import RunDirectory
from pushplan.world import Stop

_log = logging.getLogger(__name__)


def note_batch(
    store: RunDirectory,
    jobs: Sequence[Job],
    settings: JobSettings,
    about: Mapping[str, Any] | None,
) -> None:
    """Note what a run directory is asked for."""
    store.note("configuration", {**settings_dict(settings), **(about or {})})
    store.extend("policies", {job.policy.label: job.policy.identity for job in jobs})
    stops = {job.policy.label: job.policy.options.get("stop") for job in jobs}
    limits = {label: stop.seconds for label, stop in stops.items() if isinstance(stop, Stop)}
    store.extend("deadlines", {k: v for k, v in limits.items() if math.isfinite(v)})
    factor = settings.latency_factor
    mode = "" if factor is None else f", latency-aware x {factor:g}"
    titles = {}
    for job in jobs:
        setting = setting_of(*job.key[1:])
        named = "/" in job.key[1]  # scenarios of a suite have different variations
        titles[setting] = (setting if named else job.title) + mode
    store.extend("settings", titles)


def pending_jobs(
    jobs: Sequence[Job], store: RunDirectory, settings: JobSettings, any_version: bool
) -> list[IdentifiedJob]:
    """The jobs without a result; those of the others count from now on."""
    asked = [IdentifiedJob.of(job, settings) for job in jobs]
    done = {job: job for job in store.done()}
    if any_version:
        done |= {same_but_versions(spec): job for job, spec in store.specs().items()}

    def found(one: IdentifiedJob) -> str | None:
        other = same_but_versions(one.spec) if any_version else one.id
        return done.get(one.id, done.get(other))

    there = [found(one) for one in asked]
    store.show(job for job in there if job is not None)
    pending = [one for one, job in zip(asked, there, strict=True) if job is None]
    keys = store.keys()
    if changed := [one for one in pending if one.job.key in keys]:
        *_, before = store.specs(changed[0].job.key).values()
        _log.warning(
            "%d of %d jobs have results in %s from before a change: %s; they are run again, and "
            "the old results stay in %s",
            *(len(changed), len(jobs), store.path, differences(before, changed[0].spec), DATABASE),
        )
    return pending
