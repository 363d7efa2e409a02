"""The policy of the planner for navigation among movable obstacles."""

from __future__ import annotations

from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.namo.planner import Namo
from pushplan.world import Planner, Stop


def namo(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """Opens closed ways on purpose, and drives as ``push-aware`` where the way is open."""
    follower = PlanFollower(planner or Namo(), stop=stop)
    follower.actions = ("velocity", "turn_rate")
    return follower
