"""From what a robot's perception reports to a `pushplan.world.Movables`. Knows no sensor."""

from pushplan.perception.object_tracker import ObjectTracker

__all__ = ["ObjectTracker"]
