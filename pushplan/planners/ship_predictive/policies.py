"""The policies of the predictive ship planners."""

from __future__ import annotations

from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.renewing_follower import RenewingFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.planners.ship_predictive import (
    PredictivePublished,
    PredictiveShip,
    PredictiveShipNetwork,
)
from pushplan.world import Planner, Stop


def ship_predictive(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Predicts the floes along each path, and looks for a better one about every quarter hull."""
    return _renewed(planner or PredictiveShip(), 0.6, stop)


def network(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Predicts the occupancy with a network, and looks for a better path half as often."""
    return _renewed(planner or PredictiveShipNetwork(), 1.2, stop)


def published(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """The published search by a network: a new plan every 5 m with a ship of 2 m, and taken."""
    rule = Replanning(margin=None)
    return RenewingFollower(
        planner or PredictivePublished(), renewal=5.0, replanning=rule, stop=stop
    )


def _renewed(planner: Planner, renewal: float, stop: Stop | None) -> PlanFollower:
    rule = Replanning(margin=0.01)
    return RenewingFollower(planner, renewal=renewal, replanning=rule, stop=stop)
