"""What a job's result depends on, as plain data with a content hash."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import pushplan
from pushplan.evaluation.jobs import Job, JobSettings
from pushplan.evaluation.policies import PolicySpec, file_digest
from pushplan.world import InvalidInputError

_ENGINES = {"pymunk": "pymunk", "mujoco": "mujoco"}
_UNSEEN = ("cli", "drawing", "evaluation", "ros", "training")
"""Rooms of the package that no episode depends on."""
_OURS = "pushplan."


@dataclass(frozen=True)
class IdentifiedJob:
    """A job and what its result depends on.

    Args:
        job: the job.
        spec: what `job_spec` says about it.
        id: content hash of that.
    """

    job: Job
    spec: Mapping[str, Any]
    id: str

    @classmethod
    def of(cls, job: Job, settings: JobSettings) -> IdentifiedJob:
        """The job with its specification."""
        spec = job_spec(job, settings)
        return cls(job, spec, job_id(spec))


def job_spec(job: Job, settings: JobSettings) -> dict[str, Any]:
    """Everything that the result of a job depends on, as JSON values.

    Returns:
        ``policy`` (``label``, ``identity``, and ``source`` and ``options`` if it can be made from
        them again), ``scenario``, ``settings``, ``versions``, and a hash of the content for each
        of the ``files`` that the scenario names, if it names any.
    """
    spec = job.policy
    policy: dict[str, Any] = {"label": spec.label, "identity": spec.identity}
    with contextlib.suppress(TypeError):
        if isinstance(spec.source, str):
            policy |= {"options": _plain(spec.options), "source": spec.source}
    return {
        "policy": policy,
        "scenario": job.scenario.to_dict(),
        "key": [job.scenario.key, job.scenario.seed],
        "settings": settings_dict(settings),
        "versions": versions(str(job.scenario.simulator), spec.network is not None),
        **({"files": files} if (files := _files(job.scenario)) else {}),
    }


def _files(scenario: Any) -> dict[str, str]:
    """Hash of the content of each file that a variation names."""
    named = getattr(scenario, "variations", {}).items()
    return {name: file_digest(Path(path)).strip() for name, path in named if name.endswith("_file")}


def settings_dict(settings: JobSettings) -> dict[str, Any]:
    """What results depend on of what all jobs share."""
    make = settings.make_env
    return {
        "make_env": make if isinstance(make, str) else getattr(make, "__qualname__", "callable"),
        "observation": settings.observation,
        "timeout_s": settings.timeout_s,
        "latency_factor": settings.latency_factor,
    }


def job_id(spec: Mapping[str, Any]) -> str:
    """Content hash of what `job_spec` gave, 32 hexadecimal digits.

    Where a policy's file lies does not count: its content does, in ``identity``.
    """
    policy = {name: spec["policy"][name] for name in ("label", "identity")}
    text = json.dumps({**spec, "policy": policy}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def same_but_versions(spec: Mapping[str, Any]) -> str:
    """`job_id` of a job whose result may come from any version of the code and its packages."""
    return job_id({**spec, "versions": {}})


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """What differs between two specifications, in words."""
    parts = []
    for section in ("policy", "scenario", "files", "settings", "versions"):
        old, new = before.get(section, {}), now.get(section, {})
        names = [name for name in sorted({*old, *new}) if old.get(name) != new.get(name)]
        if section == "policy":  # its source may have moved, its options are in its identity
            names = [name for name in names if name == "identity"]
        parts += [f"{section} {name} {old.get(name)!r} -> {new.get(name)!r}" for name in names]
    return "; ".join(parts)


def job_of(spec: Mapping[str, Any]) -> tuple[Job, JobSettings]:
    """The job that `job_spec` described.

    Raises:
        InvalidInputError: if its policy, scenario or environment was given as a Python object.
    """
    from pushplan.scenarios import Scenario

    policy, settings = spec["policy"], spec["settings"]
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


@functools.cache
def versions(simulator: str, network: bool = False) -> dict[str, str]:
    """Versions that an episode's bytes may depend on: of our code and of the packages below it.

    Args:
        simulator: name of the simulator.
        network: whether the policy is a network.

    Returns:
        ``pushplan``, ``code`` (a hash of the source that episodes depend on) and package names.
    """
    names = ["numpy", "numba", *filter(None, [_ENGINES.get(simulator)])]
    names += ["onnxruntime"] if network else []
    return {
        "pushplan": pushplan.__version__,
        "code": _code_digest(),
        **{name: metadata.version(name) for name in names},
    }


@functools.cache
def _code_digest() -> str:
    root = Path(pushplan.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        where = path.relative_to(root)
        if where.parts[0] not in _UNSEEN and path.suffix in (".py", ".yaml", ".json", ".xml"):
            digest.update(f"{where.as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


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
    """What `_plain` wrote; classes are looked up in pushplan only."""
    if isinstance(value, list):
        return [_restored(item) for item in value]
    if not isinstance(value, Mapping):
        return value
    inner = {key: _restored(item) for key, item in value.items() if key != "class"}
    if "class" not in value:
        return inner
    module, _, name = str(value["class"]).partition(":")
    kind = getattr(importlib.import_module(module), name) if module.startswith(_OURS) else None
    if not is_dataclass(kind) or not isinstance(kind, type):
        raise InvalidInputError(f"an option names {value['class']!r}, which is no class of ours")
    return kind(**inner)
