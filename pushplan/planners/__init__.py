"""Planners and the policies made of them. Imports no simulator and no learning library."""

from typing import Any

from pushplan.planners.registry import make_planner, make_policy, planner_names, policy_names
from pushplan.world import Deadline, MaxIterations, Planner, PlanResult, PlanStatus, Policy, World

__all__ = [
    "Deadline",
    "GeometricRRT",
    "GtspMpc",
    "KinodynamicRRT",
    "MaxIterations",
    "PlanFollower",
    "PlanResult",
    "PlanStatus",
    "Planner",
    "Policy",
    "PredictiveShip",
    "PushAware",
    "ShipLattice",
    "ShortestPath",
    "World",
    "make_planner",
    "make_policy",
    "planner_names",
    "policy_for",
    "policy_names",
    "warm_up",
]

_LAZY = {
    "GeometricRRT": "pushplan.planners.rrt",
    "GtspMpc": "pushplan.planners.rearrangement",
    "KinodynamicRRT": "pushplan.planners.rrt",
    "PlanFollower": "pushplan.planners.following.plan_follower",
    "PredictiveShip": "pushplan.planners.ship_predictive",
    "PushAware": "pushplan.planners.push_aware",
    "ShipLattice": "pushplan.planners.ship_lattice.ship_lattice",
    "ShortestPath": "pushplan.planners.shortest_path",
    "policy_for": "pushplan.planners.following.plan_follower",
    "warm_up": "pushplan.planners.kernel_warmup",
}


def __getattr__(name: str) -> Any:
    """Import a planner when it is first asked for."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_LAZY[name]), name)
