"""``pushplan list``: what there is."""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Sequence
from importlib.resources import files
from itertools import zip_longest
from typing import Any

from pushplan.cli.common import say, say_json


def run(options: argparse.Namespace) -> int:
    """One name a line, with what it is for and its first line of documentation."""
    if options.kind is None:
        _say_kinds(options)
        return 0
    kinds = list(_KINDS) if options.kind == "all" else [options.kind]
    if options.json:
        say_json(
            [
                {"kind": kind, "name": name, **_facts(kind, name)}
                for kind in kinds
                for name in names_of(kind)
            ]
        )
        return 0
    for kind in kinds:
        if options.names:
            say("\n".join(names_of(kind)))
            continue
        if len(kinds) > 1:
            say(f"{kind}:")
        rows = [(name, *_facts(kind, name).values()) for name in names_of(kind)]
        _say_rows(rows, indent="  " if len(kinds) > 1 else "")
    return 0


def _say_kinds(options: argparse.Namespace) -> None:
    """Print the kinds that can be listed: one line a kind, with the number of its names."""
    counts = {kind: len(names_of(kind)) for kind in _KINDS}
    if options.json:
        say_json([{"kind": k, "count": n, "what": _KINDS[k]["what"]} for k, n in counts.items()])
    elif options.names:
        say("\n".join(counts))
    else:
        _say_rows([(kind, f"{n:3d}", _KINDS[kind]["what"]) for kind, n in counts.items()])
        say("'pushplan list KIND' lists one kind, 'pushplan list all' everything")


def _say_rows(rows: Sequence[tuple[str, ...]], indent: str = "") -> None:
    columns = zip_longest(*rows, fillvalue="")
    widths = [max(map(len, column)) for column in columns]
    for row in rows:
        line = "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=False))
        say(indent + line.rstrip())


def _facts(kind: str, name: str) -> dict[str, str]:
    """The columns beside a name; one that says what to install, where something is missing."""
    from pushplan.world import MissingDependencyError

    about = _KINDS[kind]
    try:
        if "described_by" in about:
            return _documented(about["described_by"], name)
        facts: dict[str, str] = _at(about["facts"])(name)
        return facts
    except MissingDependencyError as error:
        return {"missing": str(error)}


def names_of(kind: str) -> list[str]:
    """The names of one kind."""
    names = _at(_KINDS[kind]["names"])
    return list(names() if callable(names) else names)


def _at(place: str) -> Any:
    """The object at a place ``"module:name"``."""
    from pushplan.imports.on_demand import look_up

    return look_up("place", {place: place}, place)


def _documented(table: str, name: str) -> dict[str, str]:
    """The first line of the documentation of what a table, or a function, at a place names."""
    found = _at(table)
    thing = found(name) if callable(found) else found[name]
    return _first_line(_at(thing) if isinstance(thing, str) else thing)


def _first_line(thing: object) -> dict[str, str]:
    return {"description": (thing.__doc__ or "").partition("\n")[0]}


def policy_facts(name: str) -> dict[str, str]:
    """Tasks, action modes in order of preference, description."""
    from pushplan.learned.loading import learned_names, weights_of
    from pushplan.planners.registry import OPEN_WATER, make_policy

    if name in learned_names():
        from pushplan.learned.onnx_policy import read_specification

        network = read_specification(weights_of(name))
        algorithm = str(network.training.get("algorithm", "network")).upper()
        return {
            "tasks": ",".join(network.tasks) or "any",
            "actions": network.action.mode,
            "description": f"A network trained by {algorithm}.",
        }
    policy = make_policy(name)
    tasks = _tasks_of(getattr(policy, "goal_kind", None))
    if name in OPEN_WATER:
        tasks = "ship_ice"
    actions = ",".join(getattr(policy, "actions", ()))
    described = _documented("pushplan.planners.registry:POLICIES", name)
    return {"tasks": tasks, "actions": actions, **described}


def _tasks_of(goal_kind: str | None) -> str:
    from pushplan.envs.registry import TASKS
    from pushplan.envs.registry import goal_kind as kind_of

    chosen = [task for task in TASKS if goal_kind in (None, kind_of(task))]
    return "any" if len(chosen) == len(TASKS) else ",".join(chosen)


def _actions_of(task: str) -> list[str]:
    """Action modes of a task, its default first."""
    from pushplan.envs.registry import TASKS

    return list(_at(TASKS[task]).actions)


def suite_facts(name: str) -> dict[str, str]:
    """Task, simulator, default action mode, episodes and variations of the first start."""
    from pushplan.scenarios import suite

    scenarios = suite(name).scenarios
    first = scenarios[0]
    varied = ", ".join(f"{key}={value}" for key, value in first.variations.items())
    episodes = f"{len(scenarios)} episodes, {first.preset}"
    return {
        "task": first.task,
        "simulator": first.simulator,
        "action": _actions_of(first.task)[0],
        "episodes": f"{episodes}{varied and ': '}{varied}",
    }


def task_facts(name: str) -> dict[str, str]:
    """Action modes, description."""
    described = _documented("pushplan.envs.registry:TASKS", name)
    return {"actions": ",".join(_actions_of(name)), **described}


def action_facts(name: str) -> dict[str, str]:
    """Tasks that have it, description."""
    tasks = [task for task in names_of("tasks") if name in _actions_of(task)]
    return {"tasks": ",".join(tasks), **_documented("pushplan.envs.registry:ACTIONS", name)}


def robot_facts(name: str) -> dict[str, str]:
    """The first line of the documentation of what makes it."""
    from pushplan.world.stored.robots import robots

    return _first_line(_at(robots()[name]))


def condition_facts(name: str) -> dict[str, str]:
    """Describe the disturbances of a stress condition, and the success that it asks for."""
    from dataclasses import fields

    from pushplan.evaluation.stress_testing import CONDITIONS

    one = CONDITIONS[name]
    disturbed = [
        f"{item.name}={value:.3g}"
        for item in fields(one.disturbances)
        if isinstance(value := getattr(one.disturbances, item.name), float)
        and value != item.default
    ]
    if one.rate is not None:
        disturbed.append(f"rate={one.rate:g}")
    disturbed += [f"{key}={value}" for key, value in one.variations.items()]
    asked = "no success asked for"
    if one.success is not None:
        asked = f"success {one.success:g}"
    return {"disturbance": " ".join(disturbed) or "nothing", "asked": asked}


_KINDS: dict[str, dict[str, str]] = tomllib.loads(
    files("pushplan.cli").joinpath("kinds.toml").read_text(encoding="utf-8")
)
"""Kinds of things to list: what each kind is for, and where its names and facts are found."""
CHOICES = (*sorted(_KINDS), "all")
"""Words of `pushplan list`."""
