"""Which jobs of a batch have no result yet."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from typing import Any

from pushplan.evaluation.database import DATABASE
from pushplan.evaluation.job_identity import (
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
    """Note what a run directory is asked for; the jobs are `identified`."""
    store.note("configuration", {**settings_dict(settings), **(about or {})})
    store.extend(
        "policies", {job.policy.label: job.spec["policy"]["identity"] for job in jobs if job.spec}
    )
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


def pending_jobs(jobs: Sequence[Job], store: RunDirectory, any_version: bool) -> list[Job]:
    """The `identified` jobs without a result; results of the others count from now on."""
    done = {job: job for job in store.done()}
    if any_version:
        done |= {same_but_versions(spec): job for job, spec in store.specs().items()}

    def found(one: Job) -> str | None:
        other = same_but_versions(one.spec) if any_version and one.spec else one.id
        return done.get(one.id, done.get(other))

    _hide_outdated(jobs, store, any_version)
    there = [found(one) for one in jobs]
    store.show(job for job in there if job is not None)
    pending = [one for one, job in zip(jobs, there, strict=True) if job is None]
    keys = store.keys()
    if changed := [one for one in pending if one.key in keys]:
        *_, before = store.specs(changed[0].key).values()
        _log.warning(
            "%d of %d jobs have results in %s from before a change: %s; they are run again, and "
            "the old results stay in %s",
            *(
                len(changed),
                len(jobs),
                store.path,
                differences(before, changed[0].spec or {}),
                DATABASE,
            ),
        )
    return pending


def _hide_outdated(jobs: Sequence[Job], store: RunDirectory, any_version: bool) -> None:
    """Let results of a policy that is another one now, or was run otherwise, count no more.

    They would be averaged with those of now: a label is one policy, and a setting is run one way.
    """
    policies: dict[str, Any] = {}
    ways: dict[tuple[str, str], Any] = {}
    for spec in (job.spec for job in jobs if job.spec):
        policies[spec["policy"]["label"]] = spec["policy"]["identity"]
        ways[_setting(spec)] = _way(spec, any_version)
    outdated = []
    for job, spec in store.specs(current=True).items():
        policy = spec.get("policy", {})
        mine = _way(spec, any_version)
        changed = policies.get(policy.get("label"), policy.get("identity")) != policy.get(
            "identity"
        )
        if changed or ways.get(_setting(spec), mine) != mine:
            outdated.append(job)
    store.hide(outdated)


def _setting(spec: Mapping[str, Any]) -> tuple[str, str]:
    scenario, seed = spec.get("key", ("", 0))
    return spec.get("policy", {}).get("label", ""), setting_of(scenario, seed)


def _way(spec: Mapping[str, Any], any_version: bool) -> list[Any]:
    names = ("settings",) if any_version else ("settings", "versions")
    return [spec.get(name) for name in names]
