"""Rapidly exploring random trees: for a disc in the plane, and for the robot's own motion."""

from pushplan.planners.rrt.geometric import GeometricRRT, GeometricRRTConfig
from pushplan.planners.rrt.kinodynamic import KinodynamicRRT, KinodynamicRRTConfig

__all__ = ["GeometricRRT", "GeometricRRTConfig", "KinodynamicRRT", "KinodynamicRRTConfig"]
