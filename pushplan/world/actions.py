"""What a policy may ask of a robot; an array is an action in the environment's own space."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checks import FloatArray, number


@dataclass(frozen=True)
class Twist:
    """Velocity command in the body frame, as ROS's ``cmd_vel``.

    Args:
        linear: forward speed [m/s].
        angular: turn rate, counter-clockwise positive [rad/s].
    """

    linear: float
    angular: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "linear", number("twist.linear", self.linear))
        object.__setattr__(self, "angular", number("twist.angular", self.angular))


@dataclass(frozen=True)
class WheelSpeeds:
    """Rim speeds of the driven wheels of a differential drive [m/s]."""

    left: float
    right: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "left", number("wheel_speeds.left", self.left))
        object.__setattr__(self, "right", number("wheel_speeds.right", self.right))


Action = Twist | WheelSpeeds | FloatArray
