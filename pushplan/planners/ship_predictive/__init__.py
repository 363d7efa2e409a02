"""Ship planners that price a path by the ice as it will be once the path is driven."""

from pushplan.planners.ship_predictive.planner import PredictiveShip, PredictiveShipNetwork
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.planners.ship_predictive.published import PredictivePublished

__all__ = ["PredictiveConfig", "PredictivePublished", "PredictiveShip", "PredictiveShipNetwork"]
