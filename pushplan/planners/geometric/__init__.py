"""Planning for a disc in the plane, with no regard to how the robot moves."""

from pushplan.planners.geometric.rrt import GeometricRRT, GeometricRRTConfig

__all__ = ["GeometricRRT", "GeometricRRTConfig"]
