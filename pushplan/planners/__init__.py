"""Planners and the policies made of them. Imports no simulator and no learning library."""

from pushplan.imports.on_demand import lazy_names
from pushplan.planners.registry import (
    make_planner,
    make_policy,
    planner_names,
    policy_names,
)
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
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "rrt": "GeometricRRT KinodynamicRRT",
        "rearrangement": "GtspMpc",
        "following.plan_follower": "PlanFollower policy_for",
        "ship_predictive": "PredictiveShip",
        "push_aware": "PushAware",
        "ship_lattice.ship_lattice": "ShipLattice",
        "shortest_path": "ShortestPath",
    },
)
