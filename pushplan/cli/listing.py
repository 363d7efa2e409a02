"""``pushplan list``: what there is."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from typing import Any

from pushplan.cli.common import add_command, say

_EXAMPLES = """\
  pushplan list policies
  pushplan list suites
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "list", "list what there is, by name", _EXAMPLES, run)
    parser.add_argument("kind", choices=sorted(_KINDS), help="what to list")


def run(options: argparse.Namespace) -> int:
    """One name a line."""
    for name in _KINDS[options.kind]():
        say(name)
    return 0


def _planners() -> Iterable[str]:
    from pushplan.planners import planner_names

    return planner_names()


def _policies() -> Iterable[str]:
    from pushplan.evaluation.policies import policy_names

    return policy_names()


def _suites() -> Iterable[str]:
    from pushplan.scenarios import suite_names

    return suite_names()


def _metrics() -> Iterable[str]:
    from pushplan.metrics import metric_names

    return metric_names()


def _tasks() -> Iterable[str]:
    from pushplan.envs.registry import TASKS

    return TASKS


def _simulators() -> Iterable[str]:
    from pushplan.envs.registry import SIMULATORS

    return SIMULATORS


_KINDS: dict[str, Callable[[], Iterable[str]]] = {
    "planners": _planners,
    "policies": _policies,
    "tasks": _tasks,
    "suites": _suites,
    "metrics": _metrics,
    "simulators": _simulators,
}
