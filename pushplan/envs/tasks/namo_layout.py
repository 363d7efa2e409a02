"""Rooms whose doors are held by boxes, each with an opening that proves that there is a way."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pushplan.scenarios.rearrangement import rectangle, walls_around
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray

ROOM = (7.0, 8.0)
"""Length along x and width along y of a room [units]."""
WALL = 0.25  # half thickness of the walls [units]
DOOR = 1.0  # half width of a door [units]
BAR = (0.8, 2.4)  # depth and width of a box that no door lets through [units]
BAR_PLACE = 1.2  # of its middle before the wall [units]
SLID = 2.2  # distance by which a bar goes aside [units]
THROUGH = 2.8  # distance beyond the wall at which a box rests that went through [units]
_CLUTTER = 4  # boxes beside the way
EDGE = 2.6  # nearest that a door comes to the corner of a room [units]


@dataclass(frozen=True)
class Opening:
    """One step of a proof: boxes that move straight, and the way is more open than before.

    Args:
        boxes: their indices.
        by: how far each of them moves, along x or along y [units].
    """

    boxes: tuple[int, ...]
    by: tuple[float, float]


@dataclass
class NamoLayout:
    """A scene in units, under construction; a unit is 1 / 1.2 of the robot's width.

    Args:
        doors: of each wall between two rooms from left to right, the middles of its doors.
        sizes: depth along x and width along y of each box.
        places: x, y of each box.
        fixed: indices of the boxes that do not move.
        openings: the proof, in order.
    """

    doors: tuple[tuple[float, ...], ...]
    sizes: list[tuple[float, float]] = field(default_factory=list)
    places: list[tuple[float, float]] = field(default_factory=list)
    fixed: set[int] = field(default_factory=set)
    openings: list[Opening] = field(default_factory=list)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max."""
        return 0.0, 0.0, ROOM[0] * (len(self.doors) + 1), ROOM[1]

    def static(self, unit: float) -> StaticMap:
        """Walls around and between the rooms, in metres."""
        walls = list(walls_around(self.bounds, 2.0 * WALL))
        for i, doors in enumerate(self.doors):
            x = ROOM[0] * (i + 1)
            low = 0.0
            for door in sorted(doors):
                walls.append(rectangle(x - WALL, low, x + WALL, door - DOOR))
                low = door + DOOR
            walls.append(rectangle(x - WALL, low, x + WALL, ROOM[1]))
        return StaticMap.build([unit * wall for wall in walls], bounds=unit * np.array(self.bounds))

    def add(self, size: tuple[float, float], x: float, y: float) -> int:
        """Put a box there; returns its index."""
        self.sizes.append(size)
        self.places.append((x, y))
        return len(self.sizes) - 1

    def plug(self, rng: np.random.Generator, wall: int, door: float, size: float) -> int:
        """A box in a doorway, which opens where it is pushed straight through."""
        x = ROOM[0] * (wall + 1)
        at = x + float(rng.uniform(-0.2, 0.2))
        box = self.add((size, size), at, door + float(rng.uniform(-0.3, 0.3)))
        self.openings.append(Opening((box,), (x + THROUGH - at, 0.0)))
        return box

    def pair(self, rng: np.random.Generator, wall: int, door: float, size: float) -> None:
        """Two boxes side by side in a doorway, which open where both go through."""
        x = ROOM[0] * (wall + 1)
        at = x + float(rng.uniform(-0.2, 0.2))
        boxes = [self.add((size, 0.75 * size), at, door + side) for side in (-0.48, 0.48)]
        self.openings.append(Opening(tuple(boxes), (x + THROUGH - at, 0.0)))

    def bar(self, rng: np.random.Generator, wall: int, door: float, size: float) -> int:
        """A wide box before a door, which opens where it is pushed aside, along the wall."""
        x = ROOM[0] * (wall + 1) - BAR_PLACE
        box = self.add(BAR, x, door + float(rng.uniform(-0.1, 0.1)))
        aside = -1.0 if door > 0.5 * ROOM[1] else 1.0
        self.openings.append(Opening((box,), (0.0, aside * (SLID + 0.1))))
        return box


Hold = Callable[[NamoLayout, np.random.Generator, int, float, float], object]
"""Holds a door of a wall; the last argument is the side of a plain box [units]."""
_HOLDS: tuple[Hold, ...] = (NamoLayout.plug, NamoLayout.pair, NamoLayout.bar)


def _door(rng: np.random.Generator) -> float:
    """The middle of a door that a bar can be slid off to one side."""
    low = rng.uniform(3.2, 3.9)
    high = rng.uniform(4.1, 4.8)
    return float(low if rng.random() < 0.5 else high)


def _held(
    rng: np.random.Generator, size: float, doors: Sequence[float], holds: Sequence[Hold | None]
) -> NamoLayout:
    """One door in each wall, held by what is named, or by anything."""
    layout = NamoLayout(tuple((door,) for door in doors))
    for wall, hold in enumerate(holds):
        hold = hold or _HOLDS[rng.integers(3)]
        hold(layout, rng, wall, doors[wall], size)
    return layout


def _one_box(rng: np.random.Generator, size: float) -> NamoLayout:
    return _held(rng, size, [float(rng.uniform(EDGE, ROOM[1] - EDGE))], [NamoLayout.plug])


def _aside(rng: np.random.Generator, size: float) -> NamoLayout:
    return _held(rng, size, [_door(rng)], [NamoLayout.bar])


def _several(rng: np.random.Generator, size: float) -> NamoLayout:
    return _held(rng, size, [_door(rng), _door(rng)], [None, None])


def _order(rng: np.random.Generator, size: float) -> NamoLayout:
    return _held(rng, size, [_door(rng)] * 2, [NamoLayout.plug, NamoLayout.bar])


def _fixed(rng: np.random.Generator, size: float) -> NamoLayout:
    doors = rng.uniform(1.6, 2.4), rng.uniform(5.6, 6.4)
    layout = NamoLayout((doors,))
    held = int(rng.integers(2))
    layout.fixed = {layout.plug(rng, 0, doors[held], size)}
    layout.openings.clear()
    layout.plug(rng, 0, doors[1 - held], size)
    return layout


def _squeeze(rng: np.random.Generator, size: float) -> NamoLayout:
    doors = float(rng.uniform(EDGE, ROOM[1] - EDGE)), float(rng.uniform(EDGE, ROOM[1] - EDGE))
    layout = NamoLayout(tuple((door,) for door in doors))
    layout.plug(rng, 0, doors[0], size)
    while len(layout.sizes) <= _CLUTTER:
        x = rng.uniform(ROOM[0] + 1.0, 2.0 * ROOM[0] - 1.0)
        y = rng.uniform(0.6, ROOM[1] - 0.6)
        if x > ROOM[0] + THROUGH + 1.5 * size or abs(y - doors[0]) > 0.5 + size:
            layout.add((size, size), float(x), float(y))
    return layout


LAYOUTS: Mapping[str, Callable[[np.random.Generator, float], NamoLayout]] = {
    "one_box": _one_box,
    "aside": _aside,
    "several": _several,
    "order": _order,
    "fixed": _fixed,
    "squeeze": _squeeze,
}
"""Name -> draws a layout, given the side of a plain box [units]."""


def box_outline(size: tuple[float, float], unit: float) -> FloatArray:
    """(4, 2) corners [m] of a box of a size in units."""
    half = 0.5 * unit * np.array(size)
    return rectangle(-half[0], -half[1], half[0], half[1])
