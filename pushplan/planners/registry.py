"""Planners and policies by name. Entries are imported when they are asked for."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, cast

from pushplan.imports.on_demand import Registered, look_up
from pushplan.world import Planner, Policy, UnknownNameError

_PLANNERS = {
    "straight": "pushplan.planners.shortest_path:ShortestPath",
    "geometric-rrt": "pushplan.planners.rrt:GeometricRRT",
    "kinodynamic-rrt": "pushplan.planners.rrt:KinodynamicRRT",
    "push-aware": "pushplan.planners.push_aware:PushAware",
    "namo": "pushplan.planners.namo:Namo",
    "skeleton": "pushplan.planners.voronoi_roadmap:Skeleton",
    "ship-lattice": "pushplan.planners.ship_lattice.ship_lattice:ShipLattice",
    "ship-lattice-quick": "pushplan.planners.ship_lattice.ship_lattice:quick",
    "ship-lattice-published": "pushplan.planners.ship_lattice.ship_lattice:published",
    "ship-predictive": "pushplan.planners.ship_predictive:PredictiveShip",
    "ship-predictive-network": "pushplan.planners.ship_predictive:PredictiveShipNetwork",
    "ship-predictive-published": "pushplan.planners.ship_predictive:PredictivePublished",
}
PLANNERS = Registered("pushplan.planners", _PLANNERS)
"""Name -> "module:Class"; each is constructed without arguments by default."""

OPEN_WATER = ("ship-predictive", "ship-predictive-network", "ship-predictive-published")
"""Planners that go to a goal line through water without obstacles, and nowhere else."""

_POLICIES = {
    "straight": "pushplan.planners.shortest_path:straight",
    "geometric-rrt": "pushplan.planners.rrt.policies:geometric_rrt",
    "kinodynamic-rrt": "pushplan.planners.rrt.policies:kinodynamic_rrt",
    "push-aware": "pushplan.planners.push_aware.policies:push_aware",
    "push-aware-constant-speed": "pushplan.planners.push_aware.policies:push_aware_constant_speed",
    "namo": "pushplan.planners.namo.policies:namo",
    "skeleton": "pushplan.planners.voronoi_roadmap:skeleton",
    "ship-lattice": "pushplan.planners.ship_lattice.ship_policies:ship_lattice",
    "ship-lattice-quick": "pushplan.planners.ship_lattice.ship_policies:ship_lattice_quick",
    "ship-lattice-published": "pushplan.planners.ship_lattice.ship_policies:ship_lattice_published",
    "ship-predictive": "pushplan.planners.ship_predictive.policies:ship_predictive",
    "ship-predictive-network": "pushplan.planners.ship_predictive.policies:network",
    "ship-predictive-published": "pushplan.planners.ship_predictive.policies:published",
    "mppi": "pushplan.planners.mppi.mppi_policy:mppi",
    "cem": "pushplan.planners.mppi.mppi_policy:cem",
    "random": "pushplan.planners.random_twist:RandomTwist",
    "greedy": "pushplan.planners.rearrangement.greedy:GreedyPusher",
    "gtsp": "pushplan.planners.rearrangement:Gtsp",
    "gtsp-mpc": "pushplan.planners.rearrangement:GtspMpc",
}
POLICIES = Registered("pushplan.policies", _POLICIES)
"""Name -> "module:callable" that makes a policy."""


def planner_names(*, open_water: bool | None = None) -> tuple[str, ...]:
    """The names that `make_planner` knows.

    Args:
        open_water: only those that need open water and a goal line, or only the others; all
            if None.
    """
    if open_water is None:
        return tuple(PLANNERS)
    return tuple(name for name in PLANNERS if (name in OPEN_WATER) == open_water)


def policy_names() -> tuple[str, ...]:
    """The names that `make_policy` knows."""
    return tuple(POLICIES)


def make_planner(name: str, **options: Any) -> Planner:
    """A planner by name.

    Args:
        name: one of `planner_names()`.
        options: keyword arguments of the planner's class, or fields of its config to change.

    Raises:
        UnknownNameError: if there is no such planner, or it has no such option.
    """
    return cast(Planner, _made("planner", name, PLANNERS, options))


def make_policy(name: str, **options: Any) -> Policy:
    """A policy by name.

    Args:
        name: one of `policy_names()`.
        options: keyword arguments of the policy's factory, or fields of the config of the policy
            or of its planner to change: ``make_policy("push-aware", push_weight=2.0)``. All that
            predict pushes take an ``interaction``, `gtsp-mpc` a `QuasiStatic`.

    Raises:
        UnknownNameError: if there is no such policy, or it has no such option.
    """
    return cast(Policy, _made("policy", name, POLICIES, options))


def _made(kind: str, name: str, table: Mapping[str, str], options: dict[str, Any]) -> Any:
    factory = look_up(kind, table, name)
    known = inspect.signature(factory).parameters
    if any(p.kind is p.VAR_KEYWORD for p in known.values()):  # it knows its settings
        return factory(**options)
    made = factory(**{key: options[key] for key in options if key in known})
    changes = {key: options[key] for key in options if key not in known}
    if not changes:
        return made
    owner = getattr(made, "planner", made)
    if "interaction" in changes and hasattr(owner, "interaction"):
        made.interaction = changes.pop("interaction")
        owner = made.planner = replace(cast(Any, owner), interaction=made.interaction)
    settings: Any = getattr(owner, "config", None if owner is made else owner)
    plain = is_dataclass(settings) and not isinstance(settings, type)
    names = [field.name for field in fields(settings)] if plain else []
    for option in changes:
        if option not in names:
            raise UnknownNameError(f"option of {kind} {name!r}", option, [*known, *names])
    changed: Any = replace(settings, **changes)
    if settings is not owner and is_dataclass(owner):
        changed = replace(cast(Any, owner), config=changed)
    elif settings is not owner:
        changed = type(owner)(changed)
    if owner is made:
        return changed
    made.planner = changed
    return made
