"""Sampling-based predictive control: path integral control and the cross-entropy method."""

from pushplan.planners.mppi.mppi import Decision, Mppi
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.planners.mppi.mppi_policy import MppiPolicy

__all__ = ["Decision", "Mppi", "MppiConfig", "MppiPolicy"]
