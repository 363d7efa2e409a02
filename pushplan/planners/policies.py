"""The policies that ship with pushplan: each planner with the controller that suits it."""

from __future__ import annotations

from pushplan.control import PathFollower, PurePursuit
from pushplan.planners.geometric import GeometricRRT
from pushplan.planners.kinodynamic import KinodynamicRRT
from pushplan.planners.policy import PlanFollower
from pushplan.planners.replanning import Replanning
from pushplan.planners.straight import ShortestPath
from pushplan.world import Planner, Stop


def straight(planner: Planner | None = None) -> PlanFollower:
    """Follows the shortest path around the walls through whatever is in the way."""
    return PlanFollower(planner or ShortestPath(), PurePursuit())


def geometric_rrt(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Plans once with the two-pass geometric RRT and follows it, as the paper's baseline does."""
    return PlanFollower(
        planner or GeometricRRT(), PurePursuit(), replanning=Replanning(never=True), stop=stop
    )


def kinodynamic_rrt(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Kinodynamic RRT with replanning when the world departs from the prediction."""
    return PlanFollower(planner or KinodynamicRRT(), PathFollower(), stop=stop)
