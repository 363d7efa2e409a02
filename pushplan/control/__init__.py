"""Following a plan within the robot's limits."""

from pushplan.control.drive_to import DriveTo
from pushplan.control.limits import TwistLimiter, clamp_twist
from pushplan.control.path_follower import PathFollower
from pushplan.control.pure_pursuit import PurePursuit
from pushplan.control.tracking import Progress

__all__ = ["DriveTo", "PathFollower", "Progress", "PurePursuit", "TwistLimiter", "clamp_twist"]
