"""Commands of a policy to a robot; an array is an action in the environment's own space."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checked_fields import CheckedFields
from pushplan.world.checks import FloatArray


@dataclass(frozen=True)
class Twist(CheckedFields):
    """Velocity command in the body frame, as ROS's ``cmd_vel``.

    Args:
        linear: forward speed [m/s].
        angular: turn rate, counter-clockwise positive [rad/s].
    """

    field_prefix = "twist."

    linear: float
    angular: float


@dataclass(frozen=True)
class WheelSpeeds(CheckedFields):
    """Rim speeds of the driven wheels of a differential drive [m/s]."""

    field_prefix = "wheel_speeds."

    left: float
    right: float


Action = Twist | WheelSpeeds | FloatArray
