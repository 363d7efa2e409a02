"""Ship planners that price a path by the ice as it will be once the path is driven."""

from pushplan.planners.predictive.config import PredictiveConfig
from pushplan.planners.predictive.planner import PredictiveShip, PredictiveShipNetwork

__all__ = ["PredictiveConfig", "PredictiveShip", "PredictiveShipNetwork"]
