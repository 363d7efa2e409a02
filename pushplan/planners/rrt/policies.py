"""The policies of the random trees: each planner with the controller that suits it."""

from __future__ import annotations

from pushplan.control import PathFollower, PurePursuit
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.planners.rrt.geometric import GeometricRRT
from pushplan.planners.rrt.kinodynamic import KinodynamicRRT
from pushplan.world import Planner, Stop


def geometric_rrt(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Plans once with the two-pass geometric RRT and follows it, as the paper's baseline does."""
    return PlanFollower(
        planner or GeometricRRT(), PurePursuit(), replanning=Replanning(never=True), stop=stop
    )


def kinodynamic_rrt(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Kinodynamic RRT with replanning when the world departs from the prediction."""
    return PlanFollower(planner or KinodynamicRRT(), PathFollower(), stop=stop)
