"""Everything that a job's result depends on, as plain data with a content hash."""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
import sys
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from importlib import metadata
from typing import Any

from pushplan.envs.registry import SIMULATORS, TASKS
from pushplan.evaluation.run.job_limits import THREAD_VARIABLES, WORKER_VARIABLE
from pushplan.evaluation.run.jobs import MOST_READS, BatchStoppedError, Job, JobSettings, job_id
from pushplan.evaluation.run.policy_specs import PolicySpec, described
from pushplan.evaluation.store.provenance import PACKAGES, versions
from pushplan.evaluation.store.source_digests import (
    counted,
    file_digest,
    imported_by,
    read_digests,
    source_digest,
)
from pushplan.imports.observed_reads import Reads
from pushplan.metrics import METRICS
from pushplan.planners.registry import PLANNERS, POLICIES
from pushplan.world import InvalidInputError
from pushplan.world.stored.robots import robots

_MOST_DIFFERENCES = 4
_WORKERS_OWN = {f"${name}" for name in (*THREAD_VARIABLES, WORKER_VARIABLE, "PYTHONUNBUFFERED")}
_OF_SB3 = {"stable_baselines3", "torch"}
_OURS = "pushplan."


def identified(jobs: Iterable[Job], settings: JobSettings) -> list[Job]:
    """The jobs with their specifications."""
    jobs = list(jobs)
    policies = {id(job.policy): job.policy for job in jobs}
    # the files of a policy are read once for all of its jobs
    said = {key: _of_policy(policy) for key, policy in policies.items()}
    return [replace(job, spec=_spec(job, settings, *said[id(job.policy)])) for job in jobs]


def check_unchanged(job: Job, settings: JobSettings) -> None:
    """Refuse to run an identified job where code or files are no longer those that it names.

    Raises:
        BatchStoppedError: if they are others.
    """
    if job.spec is None:
        return
    now = job_spec(job, settings)
    if "data" in job.spec:
        now["data"] = job.spec["data"]
    if job_id(now) != job_id(job.spec):
        raise BatchStoppedError(
            f"{differences(job.spec, now)} while jobs of {job.policy.label!r} ran; what was stored "
            "is kept, and the same command goes on"
        )


def read_by(job: Job, reads: Reads) -> dict[str, str]:
    """Hashes of what code of users has read in a job that `check_unchanged` has checked.

    What its specification holds is left out.
    """
    if not job.policy.group and not any(name.endswith(".py") for name in counted):
        return {}
    folder = source_folder(job.policy.source)
    left_out = counted | _WORKERS_OWN
    names = [name for name in reads if name not in left_out]
    if folder:
        names = [name.removeprefix(os.path.join(folder, "")) for name in names]
    return read_digests(names[:MOST_READS], folder)


def source_folder(source: object) -> str:
    """Folder of a policy's ``file.py:Class``: what it reads there may be moved with it."""
    file = str(source).rpartition(":")[0]
    return os.path.dirname(file) if file.endswith(".py") else ""


def job_spec(job: Job, settings: JobSettings) -> dict[str, Any]:
    """Everything that the result of a job depends on, as JSON values.

    Returns:
        ``policy`` (``label``, ``identity``, and ``source`` and ``options`` if it can be made from
        them again), ``scenario``, ``settings``, ``versions``, and a hash of the content for each
        of the ``files`` that the scenario names, if it names any. `pending_jobs` adds ``data``:
        hashes of what earlier results have read, if it has changed since.
    """
    return _spec(job, settings, *_of_policy(job.policy))


def _of_policy(spec: PolicySpec) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the description of a policy, and versions of the libraries that its own code uses."""
    counted.clear()
    policy: dict[str, Any] = {"label": spec.label, "identity": spec.identity}
    with contextlib.suppress(TypeError):
        if isinstance(spec.source, str):
            policy |= {"options": _plain(spec.options), "source": spec.source}
    libraries = imported_by(counted)
    if str(spec.source).startswith("sb3:"):
        libraries = _OF_SB3
    others = libraries - {*PACKAGES, *sys.stdlib_module_names, "pushplan"}
    packages = sorted({name for module in others for name in _distributions().get(module, ())})
    return policy, {name: metadata.version(name) for name in packages}


def _spec(
    job: Job, settings: JobSettings, policy: Mapping[str, Any], libraries: Mapping[str, str]
) -> dict[str, Any]:
    return {
        "policy": policy,
        "scenario": job.scenario.to_dict(),
        "key": [job.scenario.key, job.scenario.seed],
        "settings": settings_dict(settings),
        "versions": {**versions(str(job.scenario.simulator)), **libraries},
        **({"files": files} if (files := _files(job, settings)) else {}),
    }


def _files(job: Job, settings: JobSettings) -> dict[str, str]:
    """Hash of each file that a variation names, and of code that is registered and not ours."""
    scenario = job.scenario
    named = getattr(scenario, "variations", {})
    files = {
        name: file_digest(path).strip() for name, path in named.items() if name.endswith("_file")
    }
    robot = str(named.get("robot", ""))
    task = str(scenario.task)
    sources = {
        "make_env": settings.make_env,
        "observation": settings.observation,
        "policy": {**PLANNERS, **POLICIES}.get(str(job.policy.source), ""),
        "simulator": SIMULATORS.get(str(scenario.simulator), ""),
        "robot": robots().get(robot, robot),
        "task": TASKS.get(task, task),
        **{f"metric {name}": metric.function for name, metric in METRICS.items()},
    }
    for name, source in sources.items():
        if isinstance(source, str):
            digest = source_digest(source.rpartition(":")[0])
        else:
            digest = described(source)
        if digest:
            files[name] = digest.strip()
    return files


_distributions = functools.cache(metadata.packages_distributions)


def settings_dict(settings: JobSettings) -> dict[str, Any]:
    """Return the settings of a batch on which results depend."""
    make = settings.make_env
    if not isinstance(make, str):
        make = getattr(make, "__qualname__", "callable")
    found = {
        "make_env": make,
        "observation": settings.observation,
        "timeout_s": settings.timeout_s,
        "latency_factor": settings.latency_factor,
    }
    if settings.clock != "wall":  # jobs of older runs do not name it
        found["clock"] = settings.clock
    return found


def same_but_versions(spec: Mapping[str, Any]) -> str:
    """`job_id` of a job whose result may come from any version of the code and its packages."""
    return job_id({**spec, "versions": {}})


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Describe the differences between two specifications, and of what was read, in words."""
    changed = []
    noted = []
    read = before.get("read", {})
    folder = source_folder(now.get("policy", {}).get("source", ""))
    now = {**now, "read": read_digests(read, folder)}
    for section in ("policy", "scenario", "files", "read", "settings", "versions"):
        old = before.get(section, {})
        new = now.get(section, {})
        # the source of a policy may have moved, its options are in its identity
        names = {"identity"} if section == "policy" else {*old, *new}
        for name in sorted(names):
            if name not in old and name in new:
                noted.append(f"{section} {name} was not noted before")
            elif old.get(name) != new.get(name):
                changed.append(f"{section} {name} {old[name]!r} -> {new.get(name)!r}")
    parts = [*changed, *noted]
    shown = parts[:_MOST_DIFFERENCES]
    if len(parts) > len(shown):
        shown.append(f"{len(parts) - len(shown)} more")
    return "; ".join(shown)


def job_of(spec: Mapping[str, Any]) -> tuple[Job, JobSettings]:
    """The job that `job_spec` described.

    Raises:
        InvalidInputError: if its policy, scenario or environment was given as a Python object.
    """
    from pushplan.scenarios import Scenario

    policy = spec["policy"]
    settings = spec["settings"]
    if "source" not in policy:
        raise InvalidInputError(
            f"policy {policy['label']!r} was given as a Python object ({policy['identity']}): only "
            "policies given by name or as 'file.py:Class' can be made again from a run directory"
        )
    scenario = Scenario.from_dict(spec["scenario"])
    if [scenario.key, scenario.seed] != spec["key"]:
        raise InvalidInputError(f"scenario {spec['key'][0]!r} is none of pushplan's own")
    if ":" not in settings["make_env"]:
        raise InvalidInputError(
            f"the environment came from the Python object {settings['make_env']!r}: only those "
            "given as 'module:function' can be made again"
        )
    options = _restored(policy["options"])
    return (
        Job(PolicySpec(policy["label"], policy["source"], options), scenario),
        JobSettings(**settings),
    )


def _plain(value: Any) -> Any:
    """JSON values for a policy's options.

    Raises:
        TypeError: if there is an object that is neither plain nor a dataclass of ours.
    """
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    kind = type(value)
    if not is_dataclass(value) or not kind.__module__.startswith(_OURS):
        raise TypeError(f"{kind.__name__} is not plain")
    inner = {one.name: _plain(getattr(value, one.name)) for one in fields(value) if one.init}
    return {"class": f"{kind.__module__}:{kind.__name__}", **inner}


def _restored(value: Any) -> Any:
    """Restore a value that `_plain` wrote; classes are looked up in pushplan only."""
    if isinstance(value, list):
        return [_restored(item) for item in value]
    if not isinstance(value, Mapping):
        return value
    inner = {key: _restored(item) for key, item in value.items() if key != "class"}
    if "class" not in value:
        return inner
    module, _, name = str(value["class"]).partition(":")
    kind = None
    if module.startswith(_OURS):
        kind = getattr(importlib.import_module(module), name)
    if not is_dataclass(kind) or not isinstance(kind, type):
        raise InvalidInputError(f"an option names {value['class']!r}, which is no class of ours")
    return kind(**inner)
