"""Commands of a policy to a robot; an array is an action in the environment's own space."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pushplan.world.checked_fields import CheckedFields
from pushplan.world.checks import FloatArray


@dataclass(frozen=True)
class Twist(CheckedFields):
    """Velocity command in the body frame, as ROS's ``cmd_vel``.

    Args:
        linear: forward speed [m/s].
        angular: turn rate, counter-clockwise positive [rad/s].
        lateral: speed to the left [m/s]; 0 for all but omnidirectional drives.
    """

    field_prefix = "twist."

    linear: float
    angular: float
    lateral: float = 0.0

    @property
    def course(self) -> tuple[float, float]:
        """Speed [m/s], negative straight back, and its bearing in the body frame [rad]."""
        if self.lateral == 0.0:
            return self.linear, 0.0
        return math.hypot(self.linear, self.lateral), math.atan2(self.lateral, self.linear)


@dataclass(frozen=True)
class WheelSpeeds(CheckedFields):
    """Rim speeds of the driven wheels of a differential drive [m/s]."""

    field_prefix = "wheel_speeds."

    left: float
    right: float


Action = Twist | WheelSpeeds | FloatArray
