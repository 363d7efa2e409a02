"""Path of a robot until it has come to a stop."""

from __future__ import annotations

import math

import numpy as np

from pushplan.control.limits import ramp_twist
from pushplan.core import geometry
from pushplan.world import RobotModel, Twist
from pushplan.world.checks import FloatArray

_STEP = 0.15
"""Greatest length of a step [circumscribed radii], and turn [rad]."""
_BRAKING_STEPS = 50


def add_twist(poses: list[FloatArray], twist: Twist, seconds: float, size: float) -> None:
    """Append the poses of a velocity that is held, in short steps, from the last pose on.

    Args:
        poses: each (3,); at least one.
        twist: the velocity.
        seconds: for how long it is held [s].
        size: circumscribed radius of the robot [m].
    """
    speed, bearing = twist.course
    add_arc(poses, speed * seconds, twist.angular * seconds, size, bearing)


def add_arc(
    poses: list[FloatArray], length: float, turn: float, size: float, bearing: float = 0.0
) -> None:
    """Append the poses of an arc in short steps, from the last pose on.

    Args:
        poses: each (3,); at least one.
        length: of the arc, negative for back [m].
        turn: on it [rad].
        size: circumscribed radius of the robot [m].
        bearing: of its beginning in the body frame [rad].
    """
    aside = np.array([0.0, 0.0, bearing])
    steps = math.ceil(max(abs(length) / (_STEP * size), abs(turn) / _STEP))
    for _ in range(steps):
        ahead = poses[-1] + aside  # as if it drove ahead
        poses.append(np.array(geometry.arc_step(ahead, length / steps, turn / steps)) - aside)


def stopping_path(
    robot: RobotModel, pose: FloatArray, twist: Twist, held: float, period: float
) -> FloatArray:
    """The path of a robot that holds a velocity for a while, and then brakes.

    Args:
        robot: one that can stop.
        pose: (3,) where it is.
        twist: what it drives.
        held: for how long it does [s].
        period: time between two commands [s].

    Returns:
        (N, 3) poses up to where it stands, the first one included.
    """
    seconds = abs(twist.course[0]) / robot.max_acceleration
    seconds = max(seconds, abs(twist.angular) / robot.max_turn_acceleration)
    step = max(period, seconds / _BRAKING_STEPS)
    held += 0.5 * (step - period)  # longer steps brake too early
    poses = [np.array(pose, dtype=np.float64)]
    while twist.linear or twist.angular or twist.lateral:
        add_twist(poses, twist, held, robot.circumscribed_radius)
        twist = ramp_twist(robot, twist, 0.0, 0.0, step)
        held = step
    return np.array(poses)
