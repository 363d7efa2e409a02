"""``pushplan list``: what there is."""

from __future__ import annotations

import argparse
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
    from pushplan.world.lazy_names import look_up

    names = look_up("kind", _KINDS, options.kind)
    for name in names() if callable(names) else names:
        say(name)
    return 0


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
