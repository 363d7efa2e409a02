"""The policies of the push-aware planner."""

from __future__ import annotations

from pushplan.control import PathFollower
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.push_aware.planner import PushAware, cautious_model
from pushplan.world import Planner, Stop


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
    """Push-aware search at constant speed, turn rate only, as in the paper; see `push_aware`."""
    model = cautious_model(friction)
    return PlanFollower(
        planner or PushAware(interaction=model), PathFollower(), interaction=model, stop=stop
    )
