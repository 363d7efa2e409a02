"""Model-predictive tracking of a path. OSQP is loaded when the first command is computed."""

from pushplan.control.mpc.mpc_config import MpcConfig
from pushplan.control.mpc.tracker import MpcTracker

__all__ = ["MpcConfig", "MpcTracker"]
