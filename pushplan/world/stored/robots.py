"""A catalogue of robots: TurtleBot3 Burger with bumpers, Jackal, a car, the 2D benchmark's.

All of them take how the robot may move (``drive``) and, as ``limits``, anything else that
`RobotModel` takes, such as ``max_speed`` [m/s]; some take a ``bumper``, one of `BUMPERS`. An
`InvalidInputError` says that there is no such bumper, or that a limit makes no sense; an
`UnknownNameError` that there is no such limit. Shapes, limits and their sources stand in
``robots.yaml``.

The ``original`` robots are those of the 2D benchmark as its own code has them, with contact radii
and wheels.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from pushplan.errors import UnknownNameError
from pushplan.files.safe_files import read_data
from pushplan.imports.named_objects import look_up_or_load
from pushplan.imports.on_demand import Registered
from pushplan.world.checks import choice, expect
from pushplan.world.robot import Drive, RobotModel

BUMPERS = ("none", "collector", "pusher", "navigation")
"""Inward-curved (keeps boxes in), straight edge, outward-curved (sheds boxes to the sides)."""
CONTACT_RADIUS = 0.02
"""Of robots, boxes and floes in the 2D benchmark's own code [m]."""
ROBOTS = (
    "turtlebot3_burger",
    "jackal",
    "racecar",
    "maze_robot",
    "box_delivery_robot",
    "area_clearing_robot",
    "original_maze_robot",
    "original_area_clearing_robot",
    "original_box_delivery_robot",
)
"""The functions of this module, which are names of robots."""
_LIMITS = tuple(
    field.name
    for field in fields(RobotModel)
    if field.name not in ("parts", "drive", "name", "wheel_parts")
)


def turtlebot3_burger(
    bumper: str = "none", drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """The TurtleBot3 Burger: 0.138 x 0.183 m, origin midway between the wheels and in its middle.

    Mass 1.07 kg with bumper, wheels 0.16 m apart, 0.22 m/s and 2.84 rad/s. Bumpers are 0.2 m wide
    and reach 0.03 to 0.05 m ahead of the body; two 8 cm boxes find room side by side.
    """
    return _robot("turtlebot3", drive, limits, bumper)


def jackal(
    bumper: str = "none", drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """The Clearpath Jackal: 0.51 x 0.43 m, 17 kg.

    2.0 m/s and 4.0 rad/s, 20 m/s² and 25 rad/s² as its driver limits them, wheels 0.3756 m apart.
    Bumpers have the Burger's shapes at 0.46 m width.
    """
    return _robot("jackal", drive, limits, bumper)


def racecar(drive: Drive | str = Drive.CAR, **limits: float) -> RobotModel:
    """A car of scale 1/10: 0.44 x 0.285 m, 3.5 kg, origin midway between the rear wheels.

    0.36 m/s ahead and back; with a wheelbase of 0.29 m and 0.28 rad of steering it turns on 1.009 m
    at best. With ``min_speed=0`` it does not reverse.
    """
    return _robot("racecar", drive, limits)


def maze_robot(drive: Drive | str = Drive.CONSTANT_SPEED, **limits: float) -> RobotModel:
    """The 2D benchmark's robot for the Maze: an octagon of 1.4 x 1.2 m, no bumper."""
    return _robot("maze robot", drive, limits)


def box_delivery_robot(drive: Drive | str = Drive.DIFFERENTIAL, **limits: float) -> RobotModel:
    """The 2D benchmark's robot for Box-Delivery: a body of 0.57 x 0.7 m and a straight bumper."""
    return _robot("box-delivery robot", drive, limits)


def area_clearing_robot(drive: Drive | str = Drive.DIFFERENTIAL, **limits: float) -> RobotModel:
    """The 2D benchmark's robot for Area-Clearing: a body of 1.3 x 1.6 m and a straight bumper."""
    return _robot("area-clearing robot", drive, limits)


def original_maze_robot(drive: Drive | str = Drive.CONSTANT_SPEED, **limits: float) -> RobotModel:
    """An octagon of 1.4 x 1.2 m and four wheels: 1.44 m wide over them."""
    return _robot("original maze robot", drive, limits)


def original_area_clearing_robot(
    drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """A body of 1.3 x 1.6 m, a straight bumper of 2.44 m and four wheels.

    It turns by at most pi / 60 rad/s where velocities are its actions.
    """
    return _robot("original area-clearing robot", drive, limits)


def original_box_delivery_robot(
    drive: Drive | str = Drive.DIFFERENTIAL, **limits: float
) -> RobotModel:
    """A trapezium, 0.8 m long and 0.5 to 0.7 m wide, without contact radius, and two wheels.

    It turns by at most 1 rad/s where velocities are its actions.
    """
    return _robot("original box-delivery robot", drive, limits)


@functools.cache
def robots() -> Mapping[str, str]:
    """Name -> "module:function" that makes a robot: ours, and those of installed distributions."""
    return Registered("pushplan.robots", {name: f"{__name__}:{name}" for name in ROBOTS})


def make_robot(name: str, drive: Drive | str, **options: Any) -> RobotModel:
    """A robot by name.

    Args:
        name: one of `robots()`, or a function as ``"file.py:function"``, ``"module:function"``.
        drive: how it may move.
        options: of the function that makes it, as limits.

    Raises:
        UnknownNameError: if there is no such robot.
        InvalidInputError: if the function cannot be loaded, or makes no `RobotModel`.
    """
    made = look_up_or_load("robot", robots(), name)(drive=drive, **options)
    return expect(f"robot {name!r}", made, RobotModel)


@functools.cache
def _catalogue() -> Any:
    return read_data(Path(__file__).with_suffix(".yaml"), "catalogue of robots")


def _robot(
    name: str, drive: Drive | str, limits: dict[str, float], bumper: str = "none"
) -> RobotModel:
    """A robot of the catalogue, with its own limits where no others are asked for."""
    choice("bumper", bumper, BUMPERS)
    for key in limits:
        if key not in _LIMITS:
            raise UnknownNameError("limit of a robot", key, _LIMITS)
    own = {"bumpers": {"none": []}, **_catalogue()[name]}
    parts = (*own.pop("parts"), *own.pop("bumpers")[bumper])
    if drive != Drive.CAR:
        own.pop("min_turning_radius", None)
    robot = RobotModel(parts, **{**own, **limits, "drive": drive, "name": name})
    if robot.drive is Drive.DIFFERENTIAL and "min_speed" not in limits:
        robot = replace(robot, min_speed=-robot.max_speed)  # reverses as fast
    return robot
