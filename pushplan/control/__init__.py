"""Following a plan within the robot's limits."""

from pushplan.control.limits import TwistLimiter, clamp_twist
from pushplan.control.path_follower import PathFollower
from pushplan.control.pure_pursuit import PurePursuit
from pushplan.control.tracking import Progress

__all__ = ["PathFollower", "Progress", "PurePursuit", "TwistLimiter", "clamp_twist"]
