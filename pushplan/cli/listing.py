"""``pushplan list``: what there is."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
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
        say_json([{"kind": kind, **one} for kind in kinds for one in _described(kind)])
        return 0
    for kind in kinds:
        if len(kinds) > 1 and not options.names:
            say(f"{kind}:")
        facts = None if options.names else _KINDS[kind].facts
        rows = [(name, *_facts(facts, name)) for name in names_of(kind)]
        _say_rows(rows, indented=len(kinds) > 1 and not options.names)
    return 0


def _say_kinds(options: argparse.Namespace) -> None:
    """What can be listed: one line a kind, with the number of its names."""
    counts = {kind: len(names_of(kind)) for kind in _KINDS}
    if options.json:
        say_json([{"kind": k, "count": n, "what": _KINDS[k].what} for k, n in counts.items()])
    elif options.names:
        say("\n".join(counts))
    else:
        _say_rows([(kind, f"{n:3d}", _KINDS[kind].what) for kind, n in counts.items()])
        say("'pushplan list KIND' lists one kind, 'pushplan list all' everything")


def _say_rows(rows: Sequence[tuple[str, ...]], indented: bool = False) -> None:
    columns = zip_longest(*rows, fillvalue="")
    widths = [max(map(len, column)) for column in columns]
    for row in rows:
        line = "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=False))
        say(("  " if indented else "") + line.rstrip())


def _described(kind: str) -> list[dict[str, str]]:
    """Each name of a kind with the columns beside it, by their headings."""
    about = _KINDS[kind]
    described = []
    for name in names_of(kind):
        facts = _facts(about.facts, name)
        headings = about.headings if len(facts) == len(about.headings) else ("missing",)
        described.append({"name": name, **dict(zip(headings, facts, strict=False))})
    return described


def _facts(facts: Callable[[str], tuple[str, ...]] | None, name: str) -> tuple[str, ...]:
    """The columns beside a name; one that says what to install, where something is missing."""
    from pushplan.world import MissingDependencyError

    try:
        return () if facts is None else facts(name)
    except MissingDependencyError as error:
        return (str(error),)


def names_of(kind: str) -> list[str]:
    """The names of one kind."""
    from pushplan.world.lazy_names import look_up

    names: Any = look_up("kind", {one: about.home for one, about in _KINDS.items()}, kind)
    return list(names() if callable(names) else names)


def _policy(name: str) -> tuple[str, ...]:
    """Tasks, action modes in order of preference, description."""
    from pushplan.learned.loading import learned_names, weights_of
    from pushplan.planners.registry import OPEN_WATER, POLICIES, make_policy

    if name in learned_names():
        from pushplan.learned.onnx_policy import read_specification

        specification = read_specification(weights_of(name))
        algorithm = specification.training.get("algorithm", "network")
        what = f"A network trained by {str(algorithm).upper()}."
        return ",".join(specification.tasks) or "any", specification.action.mode, what
    policy = make_policy(name)
    tasks = "ship_ice" if name in OPEN_WATER else _tasks_of(getattr(policy, "goal_kind", None))
    return tasks, ",".join(getattr(policy, "actions", ())), _said(POLICIES, name)


def _tasks_of(goal_kind: str | None) -> str:
    from pushplan.envs.registry import TASKS
    from pushplan.envs.registry import goal_kind as kind_of

    chosen = [task for task in TASKS if goal_kind in (None, kind_of(task))]
    return "any" if len(chosen) == len(TASKS) else ",".join(chosen)


def _suite(name: str) -> tuple[str, ...]:
    """Task, simulator, default action mode, episodes and variations of the first start."""
    from pushplan.envs.registry import TASKS
    from pushplan.scenarios import suite
    from pushplan.world.lazy_names import look_up

    scenarios = suite(name).scenarios
    first = scenarios[0]
    modes = look_up("task", TASKS, first.task).actions
    varied = ", ".join(f"{key}={value}" for key, value in first.variations.items())
    episodes = f"{len(scenarios)} episodes, {first.preset}"
    return first.task, first.simulator, modes[0], f"{episodes}{varied and ': '}{varied}"


def _planner(name: str) -> tuple[str, ...]:
    from pushplan.planners.registry import PLANNERS

    return (_said(PLANNERS, name),)


def _task(name: str) -> tuple[str, ...]:
    from pushplan.envs.registry import TASKS
    from pushplan.world.lazy_names import look_up

    return ",".join(look_up("task", TASKS, name).actions), _said(TASKS, name)


def _metric(name: str) -> tuple[str, ...]:
    from pushplan.metrics.registry import METRICS

    return (_said({name: METRICS[name].function}, name),)


def _simulator(name: str) -> tuple[str, ...]:
    from pushplan.envs.registry import SIMULATORS

    return (_said(SIMULATORS, name),)


def _action(name: str) -> tuple[str, ...]:
    """Tasks that have it, description."""
    from pushplan.envs.registry import ACTIONS, TASKS
    from pushplan.world.lazy_names import look_up

    tasks = [task for task in TASKS if name in look_up("task", TASKS, task).actions]
    return ",".join(tasks), _said(ACTIONS, name)


def _channel(name: str) -> tuple[str, ...]:
    from pushplan.observation import CHANNELS

    return ((CHANNELS[name].__doc__ or "").partition("\n")[0],)


def _condition(name: str) -> tuple[str, ...]:
    """What it disturbs, and what is asked of a policy."""
    from dataclasses import fields

    from pushplan.evaluation.stress_testing import CONDITIONS

    one = CONDITIONS[name]
    disturbed = [
        f"{item.name}={value:.3g}"
        for item in fields(one.disturbances)
        if isinstance(value := getattr(one.disturbances, item.name), float)
        and value != item.default
    ]
    disturbed += [f"rate={one.rate:g}"] if one.rate is not None else []
    disturbed += [f"{key}={value}" for key, value in one.variations.items()]
    asked = "no success asked for" if one.success is None else f"success {one.success:g}"
    return " ".join(disturbed) or "nothing", asked


def _said(table: Any, name: str) -> str:
    """The first line of the documentation of what a table names."""
    from pushplan.world.lazy_names import look_up

    return (look_up("name", table, name).__doc__ or "").partition("\n")[0]


@dataclass(frozen=True)
class _Kind:
    """One kind of things that have names."""

    what: str
    home: str  # "module:name" of the names, or of a function that gives them
    headings: tuple[str, ...]  # of the columns beside a name
    facts: Callable[[str], tuple[str, ...]]  # the columns beside a name


_ONE = ("description",)
_KINDS: dict[str, _Kind] = {
    "planners": _Kind("find a plan for a World", "pushplan.planners:planner_names", _ONE, _planner),
    "policies": _Kind(
        "drive a robot: planners that are followed, controllers, trained networks",
        "pushplan.evaluation.policies:policy_names",
        ("tasks", "actions", "description"),
        _policy,
    ),
    "tasks": _Kind(
        "what the robot has to do", "pushplan.envs.registry:TASKS", ("actions", *_ONE), _task
    ),
    "suites": _Kind(
        "lists of starts to run policies on",
        "pushplan.scenarios:suite_names",
        ("task", "simulator", "action", "episodes"),
        _suite,
    ),
    "conditions": _Kind(
        "disturbances of 'pushplan stress'",
        "pushplan.evaluation.stress_testing:CONDITIONS",
        ("disturbance", "asked"),
        _condition,
    ),
    "metrics": _Kind("scores of an episode", "pushplan.metrics:metric_names", _ONE, _metric),
    "simulators": _Kind(
        "what moves the bodies", "pushplan.envs.registry:SIMULATORS", _ONE, _simulator
    ),
    "actions": _Kind(
        "how a policy commands the robot",
        "pushplan.envs.registry:ACTIONS",
        ("tasks", *_ONE),
        _action,
    ),
    "channels": _Kind("of image observations", "pushplan.observation:CHANNELS", _ONE, _channel),
}
"""What there is."""
CHOICES = (*sorted(_KINDS), "all")
"""Words of `pushplan list`."""
