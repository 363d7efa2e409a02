"""Ship planners whose costs are those of the ice as it will be once a path is driven."""

from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.planners.ship_predictive.predictive_published import PredictivePublished
from pushplan.planners.ship_predictive.predictive_ship import PredictiveShip, PredictiveShipNetwork

__all__ = ["PredictiveConfig", "PredictivePublished", "PredictiveShip", "PredictiveShipNetwork"]
