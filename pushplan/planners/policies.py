"""The policies that ship with pushplan: each planner with the controller that suits it."""

from __future__ import annotations

from pushplan.control import PathFollower, PurePursuit
from pushplan.interaction.ice import IceInteraction
from pushplan.planners.geometric import GeometricRRT
from pushplan.planners.kinodynamic import KinodynamicRRT
from pushplan.planners.policy import PlanFollower
from pushplan.planners.predictive import PredictiveShip, PredictiveShipNetwork
from pushplan.planners.push_aware import PushAware, cautious_model
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


def push_aware(
    planner: Planner | None = None, stop: Stop | None = None, friction: float = 0.0
) -> PlanFollower:
    """Push-aware search with replanning when the world departs from the prediction.

    Args:
        planner: the push-aware planner by default.
        stop: stop rule of each planning call.
        friction: Coulomb coefficient between robot and objects, for the prediction.
    """
    model = cautious_model(friction)
    return PlanFollower(
        planner or PushAware(interaction=model), PathFollower(), interaction=model, stop=stop
    )


def push_aware_stopping(
    planner: Planner | None = None, stop: Stop | None = None, friction: float = 0.0
) -> PlanFollower:
    """`push_aware` that drives with speed and turn rate, where the task lets it, and may stop."""
    follower = push_aware(planner, stop, friction)
    follower.actions = ("velocity", "turn_rate")
    return follower


def ship_predictive(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Predicts the floes along each path, and looks again every 4 s for a better one."""
    return PlanFollower(
        planner or PredictiveShip(),
        PathFollower(),
        replanning=Replanning(every_seconds=4.0, margin=0.01),
        interaction=IceInteraction(),
        stop=stop,
    )


def ship_predictive_network(
    planner: Planner | None = None, stop: Stop | None = None
) -> PlanFollower:
    """Predicts the occupancy with a network, and looks again every 4 s for a better path."""
    return ship_predictive(planner or PredictiveShipNetwork(), stop)
