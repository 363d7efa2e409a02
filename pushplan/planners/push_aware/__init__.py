"""Planning with predicted objects: push-aware best-first search and repairs."""

from pushplan.planners.push_aware.planner import PushAware, cautious_model
from pushplan.planners.push_aware.push_aware_config import PushAwareConfig

__all__ = ["PushAware", "PushAwareConfig", "cautious_model"]
