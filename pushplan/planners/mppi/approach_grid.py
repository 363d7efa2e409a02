"""The robot's way to behind an object: a grid search from there, around what is in between."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.core import geometry as core
from pushplan.geometry import (
    GeodesicField,
    GoalDistances,
    Grid,
    clearance_field,
    geodesic_field,
    goal_distances,
)
from pushplan.motion.done_places import done_places
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.search.grid_dijkstra import grid_dijkstra
from pushplan.world import AreaGoal, ClearanceArea, Goal, Receptacle, StaticMap, World
from pushplan.world.checks import FloatArray, frozen
from pushplan.world.outline import inscribed_radius

_INSET = 1.05  # distance of an object's middle from the edges of a receptacle when it is done [r]
CLEARANCE = 0.7
"""Distance that an object's middle keeps from what is static [r]."""
_OUTSET = 1.1  # the same from the edge of a clearance area


class Field(NamedTuple):
    """A distance field."""

    values: FloatArray  # (rows, columns) [m], finite
    x: float  # Least x of the grid [m]
    y: float  # Least y
    cell: float  # Side of a cell [m]


def sample(field: Field, points: FloatArray) -> FloatArray:
    """Distances (...) at points (..., 2) [m]."""
    out = np.empty(points.shape[:-1])
    core.sample_points(*field, np.ascontiguousarray(points.reshape(-1, 2)), out.reshape(-1))
    return out


def finite(values: FloatArray) -> FloatArray:
    """The values with a number in place of inf: a little more than the greatest one."""
    known = np.isfinite(values)
    most = 1.1 * float(values[known].max()) if known.any() else 0.0
    return np.ascontiguousarray(np.where(known, values, most))


def _as_field(values: FloatArray, of: GeodesicField) -> Field:
    origin = of.grid.origin
    return Field(frozen(finite(values)), float(origin[0]), float(origin[1]), of.grid.resolution)


@functools.lru_cache(maxsize=16)
def robot_field(static: StaticMap, goal: Goal, clearance: float, cell: float) -> Field:
    """Way of the robot's middle to its goal [m], around what is static."""
    field = geodesic_field(static, goal, resolution=cell, clearance=clearance)
    return _as_field(field.filled, field)


def _places(goal: AreaGoal, radius: float) -> AreaGoal | list[FloatArray]:
    """Return the places at which the middle of an object is when the object is done."""
    places = done_places(goal, radius, _INSET)
    if not places and isinstance(goal, Receptacle):  # too narrow: as deep as possible
        middle = goal.polygon.mean(axis=0)
        return [np.stack([middle, middle])]
    return places or goal


@functools.lru_cache(maxsize=16)
def object_ways(
    static: StaticMap, goal: AreaGoal, radius: float, clearance: float
) -> GoalDistances:
    """Ways of an object's middle to where it is done, around what is static.

    Args:
        static: walls and columns.
        goal: of the objects.
        radius: circumscribed radius of the object [m].
        clearance: distance that its middle keeps from what is static [m].
    """
    return goal_distances(static, _places(goal, radius), clearance=clearance)


@functools.lru_cache(maxsize=16)
def object_field(
    static: StaticMap, goal: AreaGoal, radius: float, clearance: float, cell: float
) -> Field:
    """Lengths of `object_ways` on a grid; 0 beyond the edge of a clearance area too."""
    places = _places(goal, radius)
    found = geodesic_field(static, places, resolution=cell, clearance=clearance)
    values = found.filled
    if isinstance(goal, ClearanceArea):
        x, y = np.meshgrid(found.grid.x, found.grid.y)
        along = np.roll(goal.polygon, -1, axis=0) - goal.polygon
        lengths = np.hypot(along[:, 0], along[:, 1])
        gaps = [
            ((x - a[0]) * e[1] - (y - a[1]) * e[0]) / n
            for a, e, n in zip(goal.polygon, along, lengths, strict=True)
        ]
        values = np.where(np.max(gaps, axis=0) >= _OUTSET * radius, 0.0, values)
    return _as_field(values, found)


_CELL = 0.35  # side of a cell [R]
_MOST_CELLS = 6000
_OBSTACLE_RADIUS = 0.75  # of the disc that stands for an object in the robot's way [r]
_NEAR = 2.0  # distance to the place within which the way counts as straight [R]
# additional cost of a metre within an object [metres]
_TARGET = 6.0
_OTHERS = 2.0
_TURNS = np.radians([0.0, 25.0, -25.0, 50.0, -50.0, 75.0, -75.0])
"""Directions of a push that are tried in turn where the robot does not fit behind the object."""


@dataclass(frozen=True, eq=False)
class Approach:
    """The robot's way to behind the object that is to be pushed.

    Args:
        target: index of the object.
        field: of the way to behind it, where it lies now.
        place: (3,) pose behind it, facing along the push.
        near: up to here the way is straight, and the heading counts [m].
        weight: cost of a metre of the way [kg].
        turned: way that facing away is worth [m].
    """

    target: int
    field: Field
    place: FloatArray
    near: float
    weight: float
    turned: float


@functools.lru_cache(maxsize=8)
def _clearances(static: StaticMap, cell: float) -> tuple[Grid, FloatArray]:
    grid = Grid.cover(static.bounds, cell)
    return grid, clearance_field(static, grid)


def _grid(world: World) -> tuple[Grid, FloatArray]:
    """The grid, and the distance [m] of each cell from what is static."""
    sides = world.static.bounds[2:] - world.static.bounds[:2]
    least = float(np.sqrt(sides[0] * sides[1] / _MOST_CELLS))
    return _clearances(world.static, max(_CELL * world.robot.circumscribed_radius, least))


def standoff(world: World, k: int) -> float:
    """Distance of the robot from an object's middle when it pushes it [m]."""
    front = float(world.robot.vertices[:, 0].max())
    return front + inscribed_radius(world.movables.outline(k))


def place_behind(world: World, k: int, heading: float, skipped: int = 0) -> FloatArray:
    """(3,) pose from which the robot pushes an object along a heading, or nearly so.

    Args:
        world: the snapshot.
        k: index of the object.
        heading: of the push [rad].
        skipped: places that have failed already; after the last one the first comes again.
    """
    grid, clearances = _grid(world)
    away = standoff(world, k)
    x = world.movables.poses[k, 0]
    y = world.movables.poses[k, 1]
    needed = world.robot.inscribed_radius
    rows, cols = grid.shape
    places = []
    for turn in _TURNS:
        theta = heading + turn
        place = np.array([x - away * np.cos(theta), y - away * np.sin(theta), theta])
        row, col = grid.cell(place[0], place[1])
        if 0 <= row < rows and 0 <= col < cols and clearances[row, col] >= needed:
            places.append(place)
    if places:
        return places[skipped % len(places)]
    return np.array([x - away * np.cos(heading), y - away * np.sin(heading), heading])


def approach_to(world: World, config: MppiConfig, k: int, place: FloatArray) -> Approach:
    """The way of the robot to a pose behind object ``k``, as costs read it.

    Args:
        world: the snapshot.
        config: settings.
        k: index of the object.
        place: (3,) from `place_behind`.
    """
    grid, clearances = _grid(world)
    size = world.robot.circumscribed_radius
    needed = world.robot.inscribed_radius
    x, y = np.meshgrid(grid.x, grid.y)
    weights = np.ones(grid.shape)
    for i, pose in enumerate(world.movables.poses):
        within = needed + _OBSTACLE_RADIUS * float(world.movables.radii[i])
        inside = (x - pose[0]) ** 2 + (y - pose[1]) ** 2 < within**2
        weights[inside] += _TARGET if i == k else _OTHERS
    weights[clearances < needed] = np.inf
    rows, cols = grid.shape
    row, col = grid.cell(float(place[0]), float(place[1]))
    row = min(max(row, 0), rows - 1)
    col = min(max(col, 0), cols - 1)
    values, _, _ = grid_dijkstra(
        weights,
        np.array([row * cols + col]),
        np.zeros(grid.shape, np.bool_),
        grid.resolution,
    )
    field = Field(
        frozen(finite(values)), float(grid.origin[0]), float(grid.origin[1]), grid.resolution
    )
    return Approach(
        k,
        field,
        place,
        _NEAR * size,
        config.approach_weight * world.robot.mass,
        config.heading_weight * size,
    )
