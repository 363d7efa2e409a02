"""Selection of the jobs of a batch that have no result yet."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Container, Mapping, Sequence
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
    store.extend("policies", policies)
    store.extend("deadlines", deadlines)
    store.extend("settings", titles)


def pending_jobs(jobs: Sequence[Job], store: RunDirectory, any_version: bool) -> list[Job]:
    """The `identified` jobs without a result; results of the others count from now on."""
    stored = store.results()
    jobs, outdated = _compare_reads(jobs, stored)
    _hide_outdated(jobs, stored, store, any_version, outdated)
    valid = [one for one in stored if one.row.job not in outdated]
    done = {one.row.job: one.row.job for one in valid}
    if any_version:
        done |= {same_but_versions(one.spec): one.row.job for one in valid if one.spec}
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
    store.show(shown)
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
            next(filter(None, said), "of what other episodes of the policy have read"),
            DATABASE,
        )
    return pending


def _compare_reads(
    jobs: Sequence[Job], stored: Sequence[StoredResult]
) -> tuple[list[Job], set[str]]:
    """Compare what code of users has read for stored results with what is there now.

    It may read something once and use it in later episodes. So all results that share such code
    and began with the same ``data`` hold together, or none of them does.

    Returns:
        The jobs, with the ``data`` of the results that hold or, if none do, with that of now; and
        the results that do not hold.
    """
    first = {job.policy.label: job for job in jobs}
    groups: dict[str, dict[str, dict[str, str]]] = {}  # code of users -> data -> what was read
    places: dict[str, tuple[str, str]] = {}
    for one in stored:
        job = first.get(one.row.policy)
        if job is None or job.spec is None or job.spec["policy"] != one.spec.get("policy"):
            continue
        code = _users_code(job, one.spec)
        data = json.dumps(one.spec.get("data", {}), sort_keys=True)
        known = groups.setdefault(code, {}).setdefault(data, json.loads(data))
        read = one.spec.get("read", {})
        places[one.row.job] = code, data
        if any(known.setdefault(name, digest) != digest for name, digest in read.items()):
            places[one.row.job] = code, ""  # it changed while they ran
    holding = {}
    for code, group in groups.items():
        names = {name for known in group.values() for name in known}
        now = read_digests(names, source_folder(code))
        valid = {data: known for data, known in group.items() if known.items() <= now.items()}
        holding[code] = max(valid, key=lambda data: len(valid[data]), default=json.dumps(now))
    found = []
    for job in jobs:
        data = json.loads(holding.get(_users_code(job, job.spec or {}), "{}"))
        found.append(replace(job, spec={**(job.spec or {}), "data": data}) if data else job)
    return found, {job for job, (code, data) in places.items() if holding[code] != data}


def _users_code(job: Job, spec: Mapping[str, Any]) -> str:
    """Text that is the same for jobs in which the same code of users runs."""
    if job.policy.group:
        return str(job.policy.source)
    files = spec.get("files", {}).items()
    return json.dumps({name: one for name, one in files if not name.endswith("_file")})


def _hide_outdated(
    jobs: Sequence[Job],
    stored: Sequence[StoredResult],
    store: RunDirectory,
    any_version: bool,
    outdated: Container[str],
) -> None:
    """Let results of a policy that is another one now, or was run otherwise, count no more.

    They would be averaged with those of now: a label is one policy, and a setting is run one way.
    """
    names = ("settings",) if any_version else ("settings", "versions")
    policies: dict[str, str] = {}
    ways: dict[tuple[str, str], list[Any]] = {}
    for job in jobs:
        assert job.spec is not None
        policies[job.policy.label] = job.spec["policy"]["identity"]
        setting = job.policy.label, setting_of(*job.key[1:])
        ways[setting] = [job.spec[name] for name in names]
    hidden = []
    for one in stored:
        if not one.spec:  # saved from a CSV file, which does not say how it came about
            continue
        row = one.row
        identity = one.spec.get("policy", {}).get("identity")
        way = [one.spec.get(name) for name in names]
        changed = row.job in outdated or policies.get(row.policy, identity) != identity
        if changed or ways.get((row.policy, setting_of(row.scenario, row.seed)), way) != way:
            hidden.append(row.job)
    store.hide(hidden)
