"""Planners and policies by name. Entries are imported when they are asked for."""

from __future__ import annotations

import importlib
import inspect
from typing import Any, cast

from pushplan.world import Planner, Policy, UnknownNameError

PLANNERS: dict[str, str] = {
    "straight": "pushplan.planners.straight:ShortestPath",
    "geometric-rrt": "pushplan.planners.geometric:GeometricRRT",
    "kinodynamic-rrt": "pushplan.planners.kinodynamic:KinodynamicRRT",
}
"""Name -> "module:Class"; each is constructed without arguments by default."""

POLICIES: dict[str, str] = {
    "straight": "pushplan.planners.policies:straight",
    "geometric-rrt": "pushplan.planners.policies:geometric_rrt",
    "kinodynamic-rrt": "pushplan.planners.policies:kinodynamic_rrt",
    "random": "pushplan.planners.policy:RandomTwist",
    "greedy": "pushplan.planners.greedy:GreedyPusher",
}
"""Name -> "module:callable" that makes a policy."""


def planner_names() -> tuple[str, ...]:
    """The names that `make_planner` knows."""
    return tuple(PLANNERS)


def policy_names() -> tuple[str, ...]:
    """The names that `make_policy` knows."""
    return tuple(POLICIES)


def make_planner(name: str, **options: Any) -> Planner:
    """A planner by name.

    Args:
        name: one of `planner_names()`.
        options: keyword arguments of the planner's class.

    Raises:
        UnknownNameError: if there is no such planner, or it has no such option.
    """
    return cast(Planner, _made("planner", name, PLANNERS, options))


def make_policy(name: str, **options: Any) -> Policy:
    """A policy by name.

    Args:
        name: one of `policy_names()`.
        options: keyword arguments of the policy's factory.

    Raises:
        UnknownNameError: if there is no such policy, or it has no such option.
    """
    return cast(Policy, _made("policy", name, POLICIES, options))


def _made(kind: str, name: str, table: dict[str, str], options: dict[str, Any]) -> Any:
    factory = _load(kind, name, table)
    signature = inspect.signature(factory)
    for option in options:
        if option not in signature.parameters:
            raise UnknownNameError(f"option of {kind} {name!r}", option, signature.parameters)
    return factory(**options)


def _load(kind: str, name: str, table: dict[str, str]) -> Any:
    if not isinstance(name, str) or name not in table:
        raise UnknownNameError(kind, name, table)
    module, _, attribute = table[name].partition(":")
    return getattr(importlib.import_module(module), attribute)
