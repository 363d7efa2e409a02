"""Planning with the robot's own way of moving, and with the price of what it pushes."""

from pushplan.planners.kinodynamic.config import KinodynamicRRTConfig
from pushplan.planners.kinodynamic.rrt import KinodynamicRRT

__all__ = ["KinodynamicRRT", "KinodynamicRRTConfig"]
