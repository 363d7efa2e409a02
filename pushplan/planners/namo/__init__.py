"""Navigation among movable obstacles: open a way on purpose where none is open."""

from pushplan.planners.namo.planner import Namo, NamoConfig

__all__ = ["Namo", "NamoConfig"]
