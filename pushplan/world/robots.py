"""A catalogue of robots: the TurtleBot3 Burger with its bumpers, the Jackal, the 2D benchmark's.

All of them take how the robot may move (``drive``) and, as ``limits``, anything else that
`RobotModel` takes, such as ``max_speed`` [m/s]; some take a ``bumper``, one of `BUMPERS`. An
`InvalidInputError` says that there is no such bumper, or that a limit makes no sense; an
`UnknownNameError` that there is no such limit.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from pushplan.world.checks import FloatArray, choice
from pushplan.world.errors import UnknownNameError
from pushplan.world.robot import Drive, RobotModel

BUMPERS = ("none", "collector", "pusher", "navigation")
"""Inward-curved (keeps boxes in), straight edge, outward-curved (sheds boxes to the sides)."""
_SEGMENTS = 6
_LIMITS = tuple(
    field.name
    for field in fields(RobotModel)
    if field.name not in ("parts", "drive", "name", "wheel_parts")
)


def turtlebot3_burger(
    bumper: str = "none", drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """The TurtleBot3 Burger: 0.138 x 0.183 m, origin midway between the wheels and in its middle.

    Mass 1.07 kg with bumper, wheels 0.16 m apart, 0.22 m/s and 2.84 rad/s (ROBOTIS, TurtleBot3
    e-Manual, "Features"). Bumpers are 0.2 m wide and reach 0.03 to 0.05 m ahead of the body; two
    8 cm boxes find room side by side.
    """
    body = _box(-0.069, 0.069, 0.0915)
    parts = [body, *_bumper(bumper, 0.069, 0.0915, 0.1, 0.03, 0.02)]
    own = {"mass": 1.07, "max_speed": 0.22, "max_turn_rate": 2.84, "wheel_separation": 0.16}
    return make_robot("turtlebot3", parts, drive, own, limits)


def jackal(
    bumper: str = "none", drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """The Clearpath Jackal: 0.51 x 0.43 m, 17 kg (Clearpath, Jackal data sheet).

    2.0 m/s and 4.0 rad/s, 20 m/s² and 25 rad/s² as its driver limits them
    (github.com/jackal/jackal, ``jackal_control/config/control.yaml``), wheels 0.3756 m apart
    (``jackal_description/urdf/jackal.urdf.xacro``). Bumpers have the Burger's shapes at 0.46 m
    width.
    """
    parts = [_box(-0.255, 0.255, 0.215), *_bumper(bumper, 0.255, 0.215, 0.23, 0.05, 0.04)]
    own = {
        "mass": 17.0,
        "max_speed": 2.0,
        "max_turn_rate": 4.0,
        "max_acceleration": 20.0,
        "max_turn_acceleration": 25.0,
        "wheel_separation": 0.3756,
    }
    return make_robot("jackal", parts, drive, own, limits)


def maze_robot(drive: Drive | str = Drive.CONSTANT_SPEED, **limits: float) -> RobotModel:
    """The 2D benchmark's robot for the Maze: an octagon of 1.4 x 1.2 m, no bumper."""
    octagon = [
        *((0.7, -0.5), (0.7, 0.5), (0.6, 0.6), (-0.6, 0.6)),
        *((-0.7, 0.5), (-0.7, -0.5), (-0.6, -0.6), (0.6, -0.6)),
    ]
    own = {"mass": 1.0, "max_speed": 0.15, "max_turn_rate": 0.105, "wheel_separation": 1.0}
    return make_robot("maze robot", [np.array(octagon)], drive, own, limits)


def box_delivery_robot(drive: Drive | str = Drive.DIFFERENTIAL, **limits: float) -> RobotModel:
    """The 2D benchmark's robot for Box-Delivery: a body of 0.57 x 0.7 m and a straight bumper.

    The benchmark turns by at most (pi / 2) / 15 in a control step of 0.2 s.
    """
    parts = [_box(-0.31, 0.26, 0.35), trapezium(0.20, 0.39, 0.31, 0.53)]
    own = {"mass": 1.0, "max_speed": 0.3, "max_turn_rate": np.pi / 6.0, "wheel_separation": 0.5}
    return make_robot("box-delivery robot", parts, drive, own, limits)


def area_clearing_robot(drive: Drive | str = Drive.DIFFERENTIAL, **limits: float) -> RobotModel:
    """The 2D benchmark's robot for Area-Clearing: a body of 1.3 x 1.6 m and a straight bumper.

    The benchmark turns by at most (pi / 2) / 15 in a control step of 0.2 s.
    """
    parts = [_box(-0.7, 0.6, 0.8), trapezium(0.45, 0.9, 0.7, 1.2)]
    own = {"mass": 1.0, "max_speed": 0.2, "max_turn_rate": np.pi / 6.0, "wheel_separation": 1.2}
    return make_robot("area-clearing robot", parts, drive, own, limits)


def make_robot(
    name: str,
    parts: list[FloatArray],
    drive: Drive | str,
    own: dict[str, float],
    limits: dict[str, float],
) -> RobotModel:
    """A robot with its own limits where no others are asked for.

    Raises:
        UnknownNameError: if there is no such limit.
    """
    for key in limits:
        if key not in _LIMITS:
            raise UnknownNameError("limit of a robot", key, _LIMITS)
    values: dict[str, object] = {**own, **limits}
    drive = Drive(choice("drive", drive, [d.value for d in Drive]))
    if drive is Drive.DIFFERENTIAL and "min_speed" not in limits:
        robot = RobotModel(tuple(parts), drive=drive, name=name, **values)  # type: ignore[arg-type]
        values["min_speed"] = -robot.max_speed  # reverses as fast
    return RobotModel(tuple(parts), drive=drive, name=name, **values)  # type: ignore[arg-type]


def _box(back: float, front: float, half: float) -> FloatArray:
    return np.array([(back, -half), (front, -half), (front, half), (back, half)])


def trapezium(back: float, back_half: float, front: float, front_half: float) -> FloatArray:
    """(4, 2) corners [m] of a shape that is symmetric about x."""
    return np.array(
        [(back, -back_half), (front, -front_half), (front, front_half), (back, back_half)]
    )


def _bumper(
    kind: str,  # one of `BUMPERS`
    back: float,  # x of the face that it is mounted on [m]
    body_half: float,  # half the width of that face [m]
    half: float,  # half the width of the bumper [m]
    # how far it reaches forward in the middle, or for the navigation bumper at its ends less half
    # the curve [m]
    depth: float,
    curve: float,  # how much farther the ends (collector) or the middle (navigation) reach [m]
) -> list[FloatArray]:
    """Convex parts of a bumper."""
    choice("bumper", kind, BUMPERS)
    if kind == "none":
        return []
    if kind == "pusher":
        return [trapezium(back, body_half, back + depth, half)]
    fraction = np.linspace(-1.0, 1.0, _SEGMENTS + 1)  # parabolic edges: 3 mm off a circle at most
    if kind == "navigation":
        nose = back + 0.5 * depth + 1.5 * curve * (1.0 - fraction**2)
        edge = np.column_stack([nose, half * fraction])
        return [np.concatenate([edge, [(back, body_half), (back, -body_half)]])]
    mouth = back + depth + curve * (fraction**2 - 0.5)
    rear = body_half * fraction
    corners = zip(
        mouth, half * fraction, rear, mouth[1:], half * fraction[1:], rear[1:], strict=False
    )
    return [
        np.array([(back, r0), (m0, y0), (m1, y1), (back, r1)]) for m0, y0, r0, m1, y1, r1 in corners
    ]
