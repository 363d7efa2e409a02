"""NAMO: drive to the goal through rooms whose doors are held by boxes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np
import shapely

from pushplan.envs.tasks.maze import MazeTask
from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.geometry.free_components import FreeComponents
from pushplan.geometry.grid import Grid, clearance_field
from pushplan.scenarios.rearrangement import rectangle, walls_around
from pushplan.world import BUMPERS, GoalDisc, Movables, ScenarioError, StaticMap, World
from pushplan.world.checked_fields import OneOf, PositiveFloat
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
_CELL = 0.1  # side of the cells that are looked at [circumscribed radii]
_GAP = 0.02  # least gap between bodies at the start [circumscribed radii]
PRESETS = read_presets("namo")
_TRIES = 500
_ROOMS = 3  # at most


@dataclass(frozen=True, kw_only=True)
class NamoVariations(TaskVariations):
    """Variations of the NAMO task; None leaves the preset's value."""

    task = "namo"

    layout: Annotated[str, OneOf(tuple(LAYOUTS))] = "one_box"  # name of the layout of the doors
    # claim to the policy about which boxes do not move: the truth, that all of them move, or the
    # opposite of the truth
    movability: Annotated[str, OneOf(("known", "unknown", "wrong"))] = "known"
    box_size: PositiveFloat | None = None  # side of a plain box [m]
    # of the testbed's robot, one of `pushplan.world.BUMPERS`
    bumper: Annotated[str, OneOf(BUMPERS)] | None = None
    time_limit: PositiveFloat | None = None  # when the episode is cut off [s]


class NamoTask(MazeTask):
    """Navigation among movable obstacles: the way to the goal is closed, and can be opened.

    A maze of rooms in a row. Rewards and ends are those of the `MazeTask`. Lengths go with the
    width of the robot. Each start has an `opening` that proves that there is a way: boxes that
    are pushed straight, one step after another, with room for the robot behind them, after which
    a disc around the robot gets to the goal. Before it the robot gets there in no heading.
    """

    name = "namo"
    presets = tuple(PRESETS)
    actions: ClassVar[tuple[str, ...]] = ("velocity", "wheels")
    preset_table = PRESETS
    variation_class = NamoVariations  # type: ignore[assignment]
    variations: NamoVariations  # type: ignore[assignment]

    opening: tuple[Opening, ...] = ()
    """The proof of the last start; `Opening.by` in metres."""

    def _lay_out(self) -> None:
        self.unit = float(np.ptp(self.robot.vertices[:, 1])) / 1.2
        """Unit of the layout [m]."""
        self.reach = 2.0 * self.unit * float(np.hypot(_ROOMS * ROOM[0], ROOM[1]))

    def start(self, rng: np.random.Generator) -> World:
        """A new start: rooms, doors and the boxes that hold them, the robot and the goal."""
        self._steps = 0
        draw = LAYOUTS[self.variations.layout]
        unit = self.unit
        size = 1.0
        if self.variations.box_size is not None:
            size = self.variations.box_size / unit
        for _ in range(_TRIES):
            layout = draw(rng, size)
            world = self._world(rng, layout)
            opening = tuple(
                Opening(step.boxes, (unit * step.by[0], unit * step.by[1]))
                for step in layout.openings
            )
            if proves(world, opening):
                self.opening = opening
                assert isinstance(world.goal, GoalDisc)
                self.static = world.static
                self.goal = world.goal
                self.__dict__.pop("field", None)
                self.__dict__.pop("_farthest", None)
                return world
        raise ScenarioError(
            f"namo: no start of layout {self.variations.layout!r} was found that can be opened; "
            "try boxes of another size"
        )

    def _world(self, rng: np.random.Generator, layout: NamoLayout) -> World:
        unit = self.unit
        width = ROOM[1]
        end = layout.bounds[2]
        robot = rng.uniform((1.2, 1.2, -np.pi), (3.0, width - 1.2, np.pi))
        goal = rng.uniform((end - 2.2, 1.5), (end - 1.5, width - 1.5))
        areas = np.array([length * wide for length, wide in layout.sizes])
        mass = self.preset.box_mass
        if mass is None:
            mass = unit**2
        boxes = Movables.from_outlines(
            [box_outline(size, unit) for size in layout.sizes],
            np.column_stack([unit * np.array(layout.places), np.zeros(len(areas))]),
            masses=mass * areas,
            fixed=[k in layout.fixed for k in range(len(areas))],
        )
        return World(
            robot=self.robot,
            robot_pose=robot * (unit, unit, 1.0),
            static=layout.static(unit),
            movables=boxes,
            goal=GoalDisc(unit * goal, unit),
        )

    def told(self, world: World) -> World:
        """The scene with the movability of the boxes known, unknown or wrong."""
        world = super().told(world)
        if self.variations.movability == "known":
            return world
        fixed = world.movables.fixed
        told = np.zeros(len(fixed), dtype=bool)
        if self.variations.movability == "wrong":
            told = np.logical_not(fixed)
        return world.believing(told)


def proves(world: World, opening: Sequence[Opening]) -> bool:
    """Return True if a scene is sound and closed at first, and the steps of an opening open it.

    Every step moves boxes straight along free floor, pushed by a robot that gets behind them, and
    has as much floor as it is wide on its way.

    Args:
        world: the start.
        opening: the steps, in order, in metres.
    """
    robot = world.robot
    size = world.robot.circumscribed_radius
    if not _is_sound(world, _GAP * size):
        return False
    if _reaches_goal(_components(world, robot.inscribed_radius), world):
        return False
    for step in opening:
        by = np.array(step.by)
        boxes = list(step.boxes)
        heading = by / np.hypot(*by)
        moved = world.movables.poses.copy()
        corners = np.concatenate([world.movables.outline_world(k) for k in boxes])
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        near = float(((corners - middle) @ heading).min())
        behind = middle + (near - 1.1 * size) * heading
        free = _components(world, size)
        if free.at(world.robot_pose) != free.at(behind) or not free.at(behind):
            return False
        lane = _lane(world, behind, behind + by + 0.1 * size * heading)
        moved[boxes, :2] += by
        after = world.moved(movable_poses=moved, robot_pose=[*(behind + by), 0.0])
        if _hits(world, lane, boxes) or any(
            _hits(world, _swept(world, after, k), boxes) for k in boxes
        ):
            return False
        world = after
    return _reaches_goal(_components(world, size), world)


def _components(world: World, radius: float) -> FreeComponents:
    """The free components of a disc of ``radius`` [m] among walls and boxes."""
    objects = world.movables
    static = world.static
    grid = Grid.cover(static.bounds, _CELL * world.robot.circumscribed_radius)
    parts = [part for k in range(len(objects)) for part in objects.parts_world(k)]
    everything = StaticMap.build([*static.polygons, *parts], bounds=static.bounds)
    return FreeComponents.of(grid, clearance_field(everything, grid), radius)


def _reaches_goal(free: FreeComponents, world: World) -> bool:
    return free.at(world.robot_pose) in free.of_goal(world.navigation_goal)


def _is_sound(world: World, gap: float) -> bool:
    """Return True if no body touches another one, and the robot may turn where it stands."""
    walls = [shapely.Polygon(polygon) for polygon in world.static.polygons]
    count = len(world.movables)
    boxes = [shapely.Polygon(world.movables.outline_world(k)) for k in range(count)]
    robot = shapely.Point(world.robot_pose[:2]).buffer(world.robot.circumscribed_radius)
    for k, box in enumerate([robot, *boxes]):
        others = [*walls, *([robot, *boxes][:k])]
        if any(box.distance(other) <= gap for other in others):
            return False
    goal = world.navigation_goal
    assert isinstance(goal, GoalDisc)
    return all(box.distance(shapely.Point(goal.center)) > goal.radius for box in boxes)


def _lane(world: World, start: FloatArray, end: FloatArray) -> shapely.Geometry:
    """The floor that the robot sweeps on a straight line."""
    return shapely.LineString([start, end]).buffer(
        float(np.abs(world.robot.vertices[:, 1]).max()), cap_style="flat"
    )


def _swept(world: World, after: World, k: int) -> shapely.Geometry:
    """The floor that box ``k`` sweeps."""
    corners = np.concatenate([world.movables.outline_world(k), after.movables.outline_world(k)])
    return shapely.MultiPoint(corners).convex_hull


def _hits(world: World, floor: shapely.Geometry, boxes: Sequence[int]) -> bool:
    """Return True if a piece of floor overlaps a wall, or a box that is none of ``boxes``."""
    others = [k for k in range(len(world.movables)) if k not in boxes]
    shapes = [*world.static.polygons, *(world.movables.outline_world(k) for k in others)]
    return any(floor.intersects(shapely.Polygon(shape)) for shape in shapes)


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
