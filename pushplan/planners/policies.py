"""The policies that ship with pushplan: each planner with the controller that suits it."""

from __future__ import annotations

from pushplan.control import PathFollower, PurePursuit
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.renewing_follower import RenewingFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.planners.push_aware import PushAware, cautious_model
from pushplan.planners.rrt import GeometricRRT, KinodynamicRRT
from pushplan.planners.ship_predictive import (
    PredictivePublished,
    PredictiveShip,
    PredictiveShipNetwork,
)
from pushplan.planners.shortest_path import ShortestPath
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


def push_aware(
    planner: Planner | None = None, stop: Stop | None = None, friction: float = 0.1
) -> PlanFollower:
    """Push-aware search; drives with speed and turn rate where the task lets it.

    Args:
        planner: the push-aware planner by default.
        stop: stop rule of each planning call.
        friction: Coulomb coefficient between robot and objects, for the prediction.
    """
    follower = push_aware_constant_speed(planner, stop, friction)
    follower.actions = ("velocity", "turn_rate")
    return follower


def push_aware_constant_speed(
    planner: Planner | None = None, stop: Stop | None = None, friction: float = 0.1
) -> PlanFollower:
    """`push_aware` with the turn rate alone, as the paper's policies drive; see there."""
    model = cautious_model(friction)
    return PlanFollower(
        planner or PushAware(interaction=model), PathFollower(), interaction=model, stop=stop
    )


def ship_predictive(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Predicts the floes along each path, and looks for a better one about every half hull."""
    return _renewed(planner or PredictiveShip(), stop)


def ship_predictive_network(
    planner: Planner | None = None, stop: Stop | None = None
) -> PlanFollower:
    """Predicts the occupancy with a network, and looks for a better path as often."""
    return _renewed(planner or PredictiveShipNetwork(), stop)


def _renewed(planner: Planner, stop: Stop | None) -> PlanFollower:
    rule = Replanning(margin=0.01)
    return RenewingFollower(planner, renewal=1.2, replanning=rule, stop=stop)


def ship_predictive_published(
    planner: Planner | None = None, stop: Stop | None = None
) -> PlanFollower:
    """The published search by a network: a new plan every 5 m with a ship of 2 m, and taken."""
    rule = Replanning(margin=None)
    return RenewingFollower(
        planner or PredictivePublished(), renewal=5.0, replanning=rule, stop=stop
    )
