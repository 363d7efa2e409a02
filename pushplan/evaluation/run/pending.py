"""Selection of the jobs of a batch that have no result yet."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from pushplan.evaluation.run.job_identity import (
    differences,
    same_but_versions,
    settings_dict,
    source_folder,
)
from pushplan.evaluation.run.jobs import Job, JobSettings
from pushplan.evaluation.store.database import DATABASE, StoredResult
from pushplan.evaluation.store.rows import setting_of
from pushplan.evaluation.store.run_directory import RunDirectory
from pushplan.evaluation.store.source_digests import read_digests
from pushplan.world import Stop

_log = logging.getLogger(__name__)


def note_batch(
    store: RunDirectory,
    jobs: Sequence[Job],
    settings: JobSettings,
    about: Mapping[str, Any] | None,
) -> None:
    """Note what a run directory is asked for; the jobs are `identified`."""
    store.note("configuration", {**settings_dict(settings), **(about or {})})
    factor = settings.latency_factor
    mode = "" if factor is None else f", latency-aware x {factor:g}"
    policies: dict[str, str] = {}
    deadlines: dict[str, float] = {}
    titles: dict[str, str] = {}
    for job in jobs:
        assert job.spec is not None
        label = job.policy.label
        setting = setting_of(*job.key[1:])
        policies[label] = job.spec["policy"]["identity"]
        stop = job.policy.options.get("stop")
        if isinstance(stop, Stop) and math.isfinite(stop.seconds):
            deadlines[label] = stop.seconds
        named = "/" in job.key[1]  # scenarios of a suite have different variations
        titles[setting] = (setting if named else job.title) + mode
    store.note("jobs", len(jobs))
    # the order of this call comes first: tables compare with the first policy
    store.note("policies", {**policies, **store.about().get("policies", {}), **policies})
    store.extend("deadlines", deadlines)
    store.extend("settings", titles)


def pending_jobs(jobs: Sequence[Job], store: RunDirectory, any_version: bool) -> list[Job]:
    """The `identified` jobs without a result; from now on only results of these jobs count."""
    stored = store.results()
    shown, pending = sorted_out(jobs, stored, any_version)
    store.show_only(shown)
    before = {
        (one.row.policy, one.row.scenario, one.row.seed): one.spec
        for one in sorted(stored, key=lambda one: one.current)
    }
    if changed := [one for one in pending if one.key in before]:
        said = (differences(before[one.key], one.spec or {}) for one in changed)
        _log.warning(
            "%d of %d jobs have results in %s from before a change: %s; they are run again, and "
            "the old results stay in %s",
            len(changed),
            len(jobs),
            store.path,
            next(filter(None, said), "in what other episodes of the policy have read"),
            DATABASE,
        )
    return pending


def sorted_out(
    jobs: Sequence[Job], stored: Sequence[StoredResult], any_version: bool
) -> tuple[list[str], list[Job]]:
    """The results of `identified` jobs, by the jobs that they are stored for; jobs without one."""
    jobs = _with_data(jobs, stored)
    done = {one.row.job: one.row.job for one in stored}
    if any_version:
        done |= {same_but_versions(one.spec): one.row.job for one in stored if one.spec}
    shown = []
    pending = []
    for job in jobs:
        names = [job.id]
        if any_version and job.spec:
            names.append(same_but_versions(job.spec))
        if (there := next((done[name] for name in names if name in done), None)) is None:
            pending.append(job)
        else:
            shown.append(there)
    return shown, pending


def _with_data(jobs: Sequence[Job], stored: Sequence[StoredResult]) -> list[Job]:
    """Add the ``data`` of stored results that are still valid to the jobs.

    If none are, it is what their code has read before, as it is now. Code of a user may read
    something once and use it in later episodes: results with the same code and ``data`` are
    valid together, or none of them is.
    """
    first = {job.policy.label: job for job in jobs}
    groups: dict[str, dict[str, dict[str, str]]] = {}  # code of users -> data -> what was read
    for one in stored:
        job = first.get(one.row.policy)
        if job is None or _identity(job.spec) != _identity(one.spec):
            continue
        data = json.dumps(one.spec.get("data", {}))
        group = groups.setdefault(_users_code(job, one.spec), {})
        known = group.setdefault(data, json.loads(data))
        for name, digest in one.spec.get("read", {}).items():
            if known.setdefault(name, digest) != digest:
                known[name] = "several"
    chosen = {}
    for code, group in groups.items():
        names = {name for known in group.values() for name in known}
        now = read_digests(names, source_folder(code))
        valid = {data: known for data, known in group.items() if known.items() <= now.items()}
        chosen[code] = max(valid, key=lambda data: len(valid[data]), default=json.dumps(now))
    found = []
    for job in jobs:
        spec = job.spec or {}
        if data := json.loads(chosen.get(_users_code(job, spec), "{}")):
            job = replace(job, spec={**spec, "data": data})
        found.append(job)
    return found


def _users_code(job: Job, spec: Mapping[str, Any]) -> str:
    """A key that is the same for jobs that run the same code of users."""
    if job.policy.group:
        return str(job.policy.source)
    files = spec.get("files", {}).items()
    return json.dumps({name: one for name, one in files if not name.endswith("_file")})


def _identity(spec: Mapping[str, Any] | None) -> object:
    return (spec or {}).get("policy", {}).get("identity")
