"""``pushplan list``: what there is."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from itertools import zip_longest
from typing import Any

from pushplan.cli.common import add_command, say

_EXAMPLES = """\
  pushplan list
  pushplan list policies
  pushplan list suites --names
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "list", "list what there is, by name", _EXAMPLES, run)
    parser.add_argument(
        "kind", nargs="?", choices=sorted(_KINDS), help="what to list (default: all)"
    )
    parser.add_argument("--names", action="store_true", help="names alone, one a line")


def run(options: argparse.Namespace) -> int:
    """One name a line, with what it is for and its first line of documentation."""
    for kind in _KINDS if options.kind is None else [options.kind]:
        if options.kind is None and not options.names:
            say(f"{kind}:")
        facts = None if options.names else _FACTS.get(kind)
        rows = [(name, *_facts(facts, name)) for name in names_of(kind)]
        columns = zip_longest(*rows, fillvalue="")
        widths = [max(map(len, column)) for column in columns]
        for row in rows:
            line = "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=False))
            say(line.rstrip() if options.kind or options.names else f"  {line.rstrip()}")
    return 0


def _facts(facts: Callable[[str], tuple[str, ...]] | None, name: str) -> tuple[str, ...]:
    """The columns beside a name; one that says what to install, where something is missing."""
    from pushplan.world import MissingDependencyError

    try:
        return () if facts is None else facts(name)
    except MissingDependencyError as error:
        return (str(error),)


def names_of(kind: str) -> Iterable[str]:
    """The names of one kind."""
    from pushplan.world.lazy_names import look_up

    names: Any = look_up("kind", _KINDS, kind)
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


def _said(table: Any, name: str) -> str:
    """The first line of the documentation of what a table names."""
    from pushplan.world.lazy_names import look_up

    return (look_up("name", table, name).__doc__ or "").partition("\n")[0]


_KINDS: dict[str, str] = {
    "planners": "pushplan.planners:planner_names",
    "policies": "pushplan.evaluation.policies:policy_names",
    "tasks": "pushplan.envs.registry:TASKS",
    "suites": "pushplan.scenarios:suite_names",
    "conditions": "pushplan.evaluation.stress_testing:CONDITIONS",
    "metrics": "pushplan.metrics:metric_names",
    "simulators": "pushplan.envs.registry:SIMULATORS",
}
"""What there is -> the names themselves, or a function that gives them."""
_FACTS: dict[str, Callable[[str], tuple[str, ...]]] = {
    "planners": _planner,
    "policies": _policy,
    "tasks": _task,
    "suites": _suite,
    "metrics": _metric,
    "simulators": _simulator,
}
"""What there is -> the columns beside a name."""
