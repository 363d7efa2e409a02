"""Model-predictive tracking of a path."""

from pushplan.control.mpc.mpc_config import MpcConfig
from pushplan.control.mpc.tracker import MpcTracker

__all__ = ["MpcConfig", "MpcTracker"]
