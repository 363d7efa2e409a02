"""The policies of the predictive ship planners."""

from __future__ import annotations

from pushplan.interaction.path_sweepers import default_interaction
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.planners.ship_predictive import (
    PredictivePublished,
    PredictiveShip,
    PredictiveShipNetwork,
)
from pushplan.world import Planner, Stop


def ship_predictive(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Predicts the floes along each path, and looks for a better one about every quarter hull."""
    return _renewed(planner or PredictiveShip(), Replanning(margin=0.01, renewal=0.6), stop)


def network(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Predicts the occupancy with a network, and looks for a better path half as often."""
    rule = Replanning(margin=0.01, renewal=1.2)
    return _renewed(planner or PredictiveShipNetwork(), rule, stop)


def published(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """The published network-based search: replans every 5 hull radii and takes the new plan."""
    rule = Replanning(margin=None, renewal=5.0)
    return _renewed(planner or PredictivePublished(), rule, stop)


def _renewed(planner: Planner, rule: Replanning, stop: Stop | None) -> PlanFollower:
    return PlanFollower(planner, replanning=rule, interaction=default_interaction, stop=stop)
