"""How robots on wheels and ships look to MuJoCo's camera; nothing here touches or weighs."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from shapely import MultiPoint, box, intersection

from pushplan.drawing.palette import FLOOR_PALETTE
from pushplan.envs.simulators.base import Solids
from pushplan.envs.simulators.mujoco_shapes import Color, Surface, add_prism, color_of
from pushplan.world import RobotModel
from pushplan.world.checks import FloatArray
from pushplan.world.outline import centroid, signed_area

TYRE: Color = (0.16, 0.16, 0.17)
HUB: Color = (0.75, 0.76, 0.78)
CONTACT_GROUP = 3
"""Group of the geoms that touch, where others show the robot; the camera leaves it out."""
_DARK: Color = (0.20, 0.22, 0.25)
_WHITE: Color = (0.97, 0.97, 0.97)
_DECK: Color = (0.36, 0.53, 0.42)
_FUNNEL: Color = (0.84, 0.37, 0.0)
_WELL = 1.15  # length of a wheel's recess over the wheel's diameter
_TYRE_WIDTH = 0.5  # in units of the wheel radius
_WAIST, _ROOF = 0.66, 0.76  # body above the wheels and deck on it, in units of the footprint
_LOW, _HIGH = 0.35, 2.1  # of the base above ground, in units of the wheel radius


def add_shell(spec: Any, body: Any, robot: RobotModel, solids: Solids) -> None:
    """A base with recesses for the wheels, a narrower body, a deck, an arrow and a lidar.

    Args:
        spec: the model.
        body: the robot's, whose frame is at the height of the axle.
        robot: footprint.
        solids: heights.
    """
    hull, radius, top = robot.contact_parts[0], solids.wheel_radius, solids.robot_height
    blue = color_of(FLOOR_PALETTE.robot)
    high = min(_HIGH * radius, 0.6 * top)
    edge = tyre_place(robot, radius)
    between = max(edge - 0.6 * radius, 0.3 * edge)
    for n, part in enumerate(_beside_wheels(hull, between, radius)):
        _prism(spec, body, f"shell base {n}", part, _LOW * radius, high, radius, blue)
    middle = centroid(hull)
    waist, roof = (middle + size * (hull - middle) for size in (_WAIST, _ROOF))
    deck = top - 0.08 * (top - high)
    _prism(spec, body, "shell body", waist, high, deck, radius, _DARK)
    _prism(spec, body, "shell deck", roof, deck, top, radius, blue)
    size = _ROOF * (robot.inscribed_radius or 0.5 * robot.circumscribed_radius)
    thick = 0.02 * size
    for n, side in enumerate((1.0, -1.0)):
        arrow = size * np.array([[0.8, 0.0], [-0.2, 0.5 * side], [0.0, 0.0]])
        arrow = arrow[:: int(side)]
        _prism(spec, body, f"shell arrow {n}", arrow, top, top + thick, radius, _WHITE)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[0.3 * size, 0.12 * size, 0.0],
        pos=[-0.55 * size, 0.0, top + 0.12 * size - radius],
        **_unfelt(TYRE),
    )


def add_superstructure(spec: Any, body: Any, robot: RobotModel, solids: Solids) -> None:
    """What stands on the hull of a ship: a deck, the house with its bridge forward, a funnel.

    Args:
        spec: the model.
        body: the ship's, whose frame is at the waterline.
        robot: footprint, the hull first.
        solids: heights.
    """
    hull, top = robot.contact_parts[0], solids.robot_height
    stern, bow = float(hull[:, 0].min()), float(hull[:, 0].max())
    length, half = bow - stern, float(np.abs(hull[:, 1]).max())
    middle = centroid(hull)
    deck = middle + (0.93, 0.82) * (hull - middle)
    step = 0.3 * half  # height of a storey
    _prism(spec, body, "shell deck", deck, top, top + 0.05 * step, 0.0, _DECK)
    # begin and end as fractions of the length from the stern, half width, storeys, colour
    for n, (rear, front, wide, low, high, color) in enumerate(
        (
            (0.55, 0.76, 0.62, 0.0, 1.5, _WHITE),
            (0.60, 0.72, 0.56, 1.5, 2.3, _WHITE),
            (0.68, 0.73, 0.60, 1.6, 2.1, _DARK),
            (0.56, 0.60, 0.14, 1.5, 3.0, _FUNNEL),
        )
    ):
        x, y = (stern + rear * length, stern + front * length), wide * half
        outline = np.array([(x[0], -y), (x[1], -y), (x[1], y), (x[0], y)])
        heights = (top + low * step, top + high * step)
        _prism(spec, body, f"shell house {n}", outline, *heights, 0.0, color)


def add_tyre(wheel: Any, robot: RobotModel, radius: float, side: float) -> None:
    """The disc and the hub of a wheel, flush with the side of the robot.

    Args:
        wheel: its body, at the end of the axle.
        robot: footprint.
        radius: of the wheel [m].
        side: 1 on the left, -1 on the right.
    """
    half = 0.5 * _TYRE_WIDTH * radius
    y = side * (tyre_place(robot, radius) - 0.5 * robot.wheel_separation)
    for size, out, color in ((radius, 0.0, TYRE), (0.5 * radius, 0.1 * half, HUB)):
        wheel.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[size, half, 0.0],
            pos=[0.0, y + side * out, 0.0],
            quat=[np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0],
            **_unfelt(color),
        )


def tyre_place(robot: RobotModel, radius: float) -> float:
    """How far from the middle the tyres are shown: at the edge of the footprint [m]."""
    return float(np.abs(robot.contact_parts[0][:, 1]).max()) - 0.5 * _TYRE_WIDTH * radius


def _beside_wheels(hull: FloatArray, inside: float, radius: float) -> list[FloatArray]:
    """The convex parts of a footprint in front of the wheels, behind and between them."""
    well, far = _WELL * radius, 10.0 * float(np.abs(hull).max())
    shape = MultiPoint(hull).convex_hull
    rooms = [
        box(well, -far, far, far),
        box(-well, -inside, well, inside),
        box(-far, -far, -well, far),
    ]
    parts = [intersection(shape, room) for room in rooms]
    outlines = [
        np.array(part.exterior.coords[:-1]) for part in parts if part.area > 1e-6 * shape.area
    ]
    return [outline if signed_area(outline) > 0.0 else outline[::-1] for outline in outlines]


def _prism(
    spec: Any,
    body: Any,
    name: str,
    outline: FloatArray,
    low: float,
    high: float,
    ground: float,
    color: Color,
) -> None:
    """A prism between two heights above the ground [m]; ``ground`` is that of the body's frame."""
    add_prism(spec, body, name, outline, low - ground, high - ground, Surface(0, 0, 0.0, 0, color))


def _unfelt(color: Color) -> dict[str, Any]:
    return Surface(0, 0, 0.0, 0, color).options()
