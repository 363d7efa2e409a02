"""Planning with predicted objects: push-aware best-first search and repairs."""

from pushplan.planners.push_aware.config import PushAwareConfig
from pushplan.planners.push_aware.planner import PushAware, cautious_model

__all__ = ["PushAware", "PushAwareConfig", "cautious_model"]
