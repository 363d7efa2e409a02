"""Sampling-based predictive control: path integral control and the cross-entropy method."""

from pushplan.planners.mppi.costs import RolloutCost
from pushplan.planners.mppi.mppi import Decision, Mppi
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.mppi_policy import MppiPolicy
from pushplan.planners.mppi.rollout_model import Rollouts

__all__ = ["Decision", "Mppi", "MppiConfig", "MppiPolicy", "RolloutCost", "Rollouts"]
