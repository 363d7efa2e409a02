"""The robots of the 2D benchmark as its own code has them, with contact radii and wheels.

Dimensions are those of version 0.1.1 of the registry's package ``benchnpin``; origins are those of
its bodies. Wheels push objects and do not count at walls.
"""

from __future__ import annotations

import math

import numpy as np

from pushplan.world.checks import FloatArray
from pushplan.world.robot import Drive, RobotModel
from pushplan.world.robots import make_robot, trapezium

CONTACT_RADIUS = 0.02
"""Of robots, boxes and floes [m]."""


def original_maze_robot(drive: Drive | str = Drive.CONSTANT_SPEED, **limits: float) -> RobotModel:
    """An octagon of 1.4 x 1.2 m and four wheels: 1.44 m wide over them."""
    half = np.array([(0.7, -0.5), (0.7, 0.5), (0.55, 0.6), (-0.55, 0.6)])
    octagon = np.concatenate([half, -half])
    own = {"mass": 1.0, "max_speed": 0.15, "max_turn_rate": math.pi / 30.0}
    own |= {"wheel_separation": 1.3, "contact_radius": CONTACT_RADIUS, "wheel_parts": 4}
    wheels = _wheels(((-0.55, -0.2), (0.2, 0.55)), 0.6, 0.7)
    wheels[2] = np.array([(0.2, 0.6), (0.55, 0.6), (0.5, 0.7), (0.2, 0.7)])  # left, ahead
    return make_robot("original maze robot", [octagon, *wheels], drive, own, limits)


def original_area_clearing_robot(
    drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """A body of 1.3 x 1.6 m, a straight bumper of 2.44 m and four wheels.

    It turns by at most pi / 60 rad/s where velocities are its actions. The body itself has no
    contact radius there; here it is drawn smaller by as much.
    """
    x, y = 0.65 - CONTACT_RADIUS, 0.8 - CONTACT_RADIUS
    body = np.array([(-x, -y), (x, -y), (x, y), (-x, y)])
    bumper = trapezium(0.45, 0.9, 0.7, 1.2)
    own = {"mass": 1.0, "max_speed": 0.2, "max_turn_rate": math.pi / 60.0}
    own |= {"wheel_separation": 1.7, "contact_radius": CONTACT_RADIUS, "wheel_parts": 4}
    wheels = _wheels(((-0.55, -0.2), (0.2, 0.55)), 0.8, 0.9)
    return make_robot("original area-clearing robot", [body, bumper, *wheels], drive, own, limits)


def original_box_delivery_robot(
    drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """A trapezium, 0.8 m long and 0.5 to 0.7 m wide, without contact radius, and two wheels.

    It turns by at most 1 rad/s where velocities are its actions. The wheels have a contact radius
    of 2 cm there; here they are drawn larger by as much.
    """
    shift = 0.4 - 17.0 / 45.0  # of the middle of its length from its centre of area
    body = trapezium(-0.4 - shift, 0.25, 0.4 - shift, 0.35)
    r = CONTACT_RADIUS
    wheels = _wheels(((-0.4 - r, -0.15 + r),), 0.2 - r, 0.3 + r)
    own = {"mass": 1.0, "max_speed": 0.3, "max_turn_rate": 1.0}
    own |= {"wheel_separation": 0.5, "wheel_parts": 2}
    return make_robot("original box-delivery robot", [body, *wheels], drive, own, limits)


def _wheels(
    along: tuple[tuple[float, float], ...],  # x from and to, of each pair [m]
    inner: float,  # y from [m]
    outer: float,  # y to [m]
) -> list[FloatArray]:
    """Pairs of rectangles, left and right."""
    left = [np.array([(a, inner), (b, inner), (b, outer), (a, outer)]) for a, b in along]
    return [wheel * (1.0, side) for wheel in left for side in (1.0, -1.0)]
