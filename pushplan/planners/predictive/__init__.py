"""Ship planners that price a path by the ice as it will be once the path is driven."""

from pushplan.planners.predictive.config import PredictiveConfig
from pushplan.planners.predictive.planner import PredictiveShip, PredictiveShipNetwork
from pushplan.planners.predictive.published import PredictivePublished

__all__ = ["PredictiveConfig", "PredictivePublished", "PredictiveShip", "PredictiveShipNetwork"]
