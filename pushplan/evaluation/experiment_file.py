"""Experiment files: YAML that says what is run; read for `Experiment.load`."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pushplan.errors import short
from pushplan.evaluation.run.jobs import JobSettings
from pushplan.evaluation.run.policy_specs import PolicySpec, parse_policy, policy_names
from pushplan.files.safe_files import known_keys
from pushplan.imports.named_objects import absolute
from pushplan.scenarios.suite import distinct, seeds_of
from pushplan.world import Deadline, SchemaError
from pushplan.world.checks import (
    choice,
    expect,
    integer,
    number,
)

if TYPE_CHECKING:
    from pushplan.scenarios import Suite

SCHEMA = "pushplan-experiment/1"
"""Name and version of the file format; files of another version are refused."""
EPISODES = 20
MOST_POLICIES = 1000

ALL = "all"
"""An entry of ``policies``: every policy that comes with pushplan."""
_KEYS = ("schema", "name", "suites", "policies", "episodes", "seed", "metrics", "timeout_s")
_MORE = ("observation", "latency_factor", "clock", "memory_limit_mb", "traces", "misfits")
_MISFITS = ("refuse", "skip")
_POLICY = ("policy", "label", "parameters", "sweep", "deadline_s")
_SUITE = ("suite", "scenarios", "worlds", "task", "episodes", "seed", "variations", "policies")
_MADE = ("simulator", "preset")
_FILE = re.compile(
    r"(.*[=:])?([^=:]+(?:\.(?:onnx|zip)|\.(?:py|onnx|zip)(?=:[^:]*$)))(:[^:]*)?", re.DOTALL
)
"""A text with a file: ``LABEL=FILE.py:NAME``, ``onnx:FILE.onnx``, ``sb3:FILE.zip`` ..."""


def fields_of(data: object, folder: Path) -> dict[str, Any]:
    """The arguments of `Experiment` that plain values give; see its ``from_dict``."""
    known_keys("experiment", data, (*_KEYS, *_MORE), ("schema", "suites", "policies"))
    assert isinstance(data, Mapping)
    if data["schema"] != SCHEMA:
        raise SchemaError(f"this pushplan reads schema {SCHEMA!r}, got {short(data['schema'])}")
    episodes = integer("episodes", data.get("episodes", EPISODES), low=1)
    seed = integer("seed", data.get("seed", 0), low=0)
    names = ("timeout_s", "observation", "latency_factor", "clock")
    policies = [_policies(one, folder) for one in _list("policies", data["policies"])]
    given = _list("suites", data["suites"])
    each = episodes if "episodes" in data else 1  # a file without a spread is one scene
    suites = distinct([_suite(one, episodes, each, seed, folder) for one in given])
    only = {
        suite.name: _texts("policies of a suite", one["policies"])
        for suite, one in zip(suites, given, strict=True)
        if isinstance(one, Mapping) and "policies" in one
    }
    metrics = _texts("metrics", data.get("metrics", ()))
    return {
        "name": str(data.get("name", "experiment")),
        "suites": suites,
        "policies": tuple(itertools.chain.from_iterable(policies)),
        "only": only,
        "settings": JobSettings(**{name: data[name] for name in names if name in data}),
        "metrics": tuple(_beside(one, folder) for one in metrics),
        "allow_misfits": choice("misfits", data.get("misfits", "refuse"), _MISFITS) == "skip",
        **{name: data[name] for name in ("traces", "memory_limit_mb") if name in data},
    }


def _list(what: str, value: object) -> Sequence[Any]:
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise SchemaError(f"{what} must be a list with at least one entry, got {short(value)}")
    return value


def _texts(what: str, value: object) -> Sequence[str]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise SchemaError(f"{what} must be a list of texts, got {short(value)}")
    return [expect(what, one, str) for one in value]


def _beside(source: str, folder: Path) -> str:
    """A text that may name a ``file.py`` beside the experiment file, made absolute."""
    if (found := _FILE.fullmatch(source)) is None:
        return source
    before, file, name = found.groups(default="")
    return f"{before}{_path(file, folder)}{name}"


def _path(file: str, folder: Path) -> Path:
    path = Path(file).expanduser()
    return path if path.is_absolute() else (folder / path).resolve()


def _suite(given: object, episodes: int, each: int, seed: int, folder: Path) -> Suite:
    """Read an entry of ``suites``: a name, or a mapping.

    Args:
        given: the entry.
        episodes: default for a suite of pushplan.
        each: default for each world file.
        seed: default.
        folder: where paths begin.
    """
    from pushplan.envs.registry import default_preset
    from pushplan.scenarios import Scenario, Suite, load_scenarios, suite, world_suite

    entry = {"suite": given} if isinstance(given, str) else given
    made = isinstance(entry, Mapping) and ("worlds" in entry or "task" in entry)
    known_keys("suite", entry, (*_SUITE, *_MADE, "label") if made else _SUITE, ())
    assert isinstance(entry, Mapping)
    if sum(kind in entry for kind in ("suite", "scenarios", "worlds", "task")) != 1:
        raise SchemaError(
            "an entry of suites has either 'suite', a name, 'task', a name or 'file.py:Class', "
            f"'scenarios', a file, or 'worlds', folders and files: got {short(dict(entry))}"
        )
    options = {key: expect(key, entry[key], str) for key in _MADE if key in entry}
    first = integer("seed", entry.get("seed", seed), low=0)
    if "scenarios" in entry:
        path = _path(expect("scenarios", entry["scenarios"], str), folder)
        found = Suite(path.stem, 1, tuple(load_scenarios(path)))
    elif "worlds" in entry:
        worlds = entry["worlds"]
        if isinstance(worlds, str):
            worlds = [worlds]
        found = world_suite(
            [_path(expect("worlds", name, str), folder) for name in _list("worlds", worlds)],
            episodes=entry.get("episodes", each),
            first_seed=first,
            **options,
        )
    elif "task" in entry:
        task = absolute(expect("task", entry["task"], str), folder)
        simulator = options.get("simulator", "pymunk")
        preset = options.get("preset") or default_preset(task, simulator)
        start = Scenario(task, simulator, preset, seed=first)
        found = seeds_of(start, entry.get("episodes", episodes))
    else:
        episodes = integer("episodes", entry.get("episodes", episodes), low=1)
        found = suite(entry["suite"], episodes=episodes, first_seed=first)
    changes = entry.get("variations", {})
    if not isinstance(changes, Mapping):
        raise SchemaError(f"variations must be a mapping, got {short(changes)}")
    words = ",".join(f"{key}={value}" for key, value in changes.items())
    if isinstance(changes.get("robot"), str):
        changes = {**changes, "robot": absolute(changes["robot"], folder)}
    scenarios = tuple(
        replace(one, variations={**one.variations, **changes}) for one in found.scenarios
    )
    name = expect("label", entry.get("label", found.name), str)
    if "task" in entry and "label" in entry:
        scenarios = tuple(replace(one, name=name) for one in scenarios)
    return Suite(f"{name}[{words}]" if words else name, found.version, scenarios)


def _policies(given: object, folder: Path) -> Iterable[PolicySpec]:
    """Read an entry of ``policies``: a text, or a mapping; a sweep gives one for each value."""
    if given == ALL:
        yield from map(parse_policy, policy_names())
        return
    entry = {"policy": given} if isinstance(given, str) else given
    known_keys("policy", entry, _POLICY, ("policy",))
    assert isinstance(entry, Mapping)
    source = _beside(expect("policy", entry["policy"], str), folder)
    label = f"{entry['label']}=" if "label" in entry else ""
    spec = parse_policy(label + source)
    options = {**spec.options, **_mapping("parameters", entry.get("parameters", {}))}
    if "deadline_s" in entry:
        options["stop"] = Deadline(number("deadline_s", entry["deadline_s"], low=0.0))
    sweep = _mapping("sweep", entry.get("sweep", {}))
    values = [_list(f"sweep of {name}", given) for name, given in sweep.items()]
    if (count := math.prod(len(one) for one in values)) > MOST_POLICIES:
        raise SchemaError(f"a sweep may give {MOST_POLICIES} policies, this one gives {count}")
    for combination in itertools.product(*values):
        chosen = dict(zip(sweep, combination, strict=True))
        words = ""
        for name, value in chosen.items():
            text = str(value)
            if isinstance(value, int | float):
                text = f"{value:g}"
            words += f"@{name}-{re.sub(r'[^A-Za-z0-9_.+-]', '_', text)}"
        yield PolicySpec(f"{spec.label}{words}"[:64], spec.source, {**options, **chosen})


def _mapping(what: str, value: object) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise SchemaError(f"{what} must be a mapping from names to values, got {short(value)}")
    return dict(value)
