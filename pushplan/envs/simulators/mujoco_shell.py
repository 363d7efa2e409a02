"""Appearance of wheeled robots and ships in MuJoCo's camera; nothing here touches or weighs."""

from __future__ import annotations

from typing import Any

import numpy as np
from shapely import MultiPoint, box, intersection

from pushplan.drawing.palette import FLOOR_PALETTE
from pushplan.envs.simulators.base import Solids
from pushplan.envs.simulators.mujoco_library import mujoco
from pushplan.envs.simulators.mujoco_shapes import add_geom, add_prism
from pushplan.world import RobotModel
from pushplan.world.checks import FloatArray
from pushplan.world.outline import centroid, signed_area

CONTACT_GROUP = 3
"""Group of the geoms that touch, where others show the robot; the camera leaves it out."""
_WELL = 1.15  # length of a wheel's recess over the wheel's diameter
_TYRE_WIDTH = 0.5  # in units of the wheel radius
# body above the wheels and deck on it, in units of the footprint
_WAIST = 0.66
_ROOF = 0.76
# of the base above ground, in units of the wheel radius
_LOW = 0.35
_HIGH = 2.1
_HOUSES = (
    (0.55, 0.76, 0.62, 0.0, 1.5, "white"),
    (0.60, 0.72, 0.56, 1.5, 2.3, "white"),
    (0.68, 0.73, 0.60, 1.6, 2.1, "dark"),
    (0.56, 0.60, 0.14, 1.5, 3.0, "funnel"),
)
"""On the deck of a ship: begin and end as fractions of the length from the stern, half width in
units of the ship's, lower and upper end in storeys, colour."""


def add_shell(spec: Any, robot: RobotModel, solids: Solids) -> None:
    """A base with recesses for the wheels, a narrower body, a deck, an arrow and a lidar.

    Args:
        spec: the model, whose robot and wheels have their frames at the height of the axle.
        robot: footprint.
        solids: heights.
    """
    hull = robot.contact_parts[0]
    radius = solids.wheel_radius
    top = solids.robot_height
    body = spec.body("robot")
    blue = FLOOR_PALETTE.robot
    # the tyres are shown at the edge of the footprint
    edge = float(np.abs(hull[:, 1]).max()) - 0.5 * _TYRE_WIDTH * radius
    high = min(_HIGH * radius, 0.6 * top)
    deck = top - 0.08 * (top - high)
    middle = centroid(hull)
    waist, roof = (middle + size * (hull - middle) for size in (_WAIST, _ROOF))
    size = _ROOF * (robot.inscribed_radius or 0.5 * robot.circumscribed_radius)
    halves = [
        (size * np.array([[0.8, 0.0], [-0.2, 0.5 * side], [0.0, 0.0]]))[:: int(side)]
        for side in (1.0, -1.0)
    ]
    base = _beside_wheels(hull, max(edge - 0.6 * radius, 0.3 * edge), radius)
    pieces = [
        *((part, _LOW * radius, high, "shell") for part in base),
        (waist, high, deck, "dark"),
        (roof, deck, top, "shell"),
        *((half, top, top + 0.02 * size, "white") for half in halves),
    ]
    for n, (outline, low, upper, kind) in enumerate(pieces):
        color = blue if kind == "shell" else None
        add_prism(spec, body, f"shell {n}", outline, low - radius, upper - radius, kind, color)
    lidar = [0.3 * size, 0.12 * size, 0.0]
    place = [-0.55 * size, 0.0, top + 0.12 * size - radius]
    add_geom(spec, body, "lidar", "cylinder", lidar, place, "tyre")
    half_width = 0.5 * _TYRE_WIDTH * radius
    for name, side in (("left wheel", 1.0), ("right wheel", -1.0)):
        y = side * (edge - 0.5 * robot.wheel_separation)
        for size, out, kind in ((radius, 0.0, "tyre"), (0.5 * radius, 0.1 * half_width, "hub")):
            spec.body(name).add_geom(
                spec.find_default(kind),
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                size=[size, half_width, 0.0],
                pos=[0.0, y + side * out, 0.0],
                quat=[np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0],
            )


def add_superstructure(spec: Any, robot: RobotModel, solids: Solids) -> None:
    """Add the superstructure of a ship: a deck, the house with its bridge forward, a funnel.

    Args:
        spec: the model, in which the ship's frame is at the waterline.
        robot: footprint, the hull first.
        solids: heights.
    """
    hull = robot.contact_parts[0]
    top = solids.robot_height
    body = spec.body("robot")
    stern = float(hull[:, 0].min())
    bow = float(hull[:, 0].max())
    length = bow - stern
    half = float(np.abs(hull[:, 1]).max())
    middle = centroid(hull)
    deck = middle + (0.93, 0.82) * (hull - middle)
    step = 0.3 * half  # height of a storey
    add_prism(spec, body, "shell deck", deck, top, top + 0.05 * step, "deck")
    for n, (rear, front, wide, low, high, kind) in enumerate(_HOUSES):
        x0 = stern + rear * length
        x1 = stern + front * length
        y = wide * half
        outline = np.array([(x0, -y), (x1, -y), (x1, y), (x0, y)])
        heights = (top + low * step, top + high * step)
        add_prism(spec, body, f"shell house {n}", outline, *heights, kind)


def _beside_wheels(hull: FloatArray, inside: float, radius: float) -> list[FloatArray]:
    """The convex parts of a footprint in front of the wheels, behind and between them."""
    well = _WELL * radius
    far = 10.0 * float(np.abs(hull).max())
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
