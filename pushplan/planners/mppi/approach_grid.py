"""The robot's way to behind an object: a grid search from there, around what is in between."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from pushplan.geometry import Grid, clearance_field
from pushplan.planners.mppi.fields import Field, finite
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.search.grid_dijkstra import grid_dijkstra
from pushplan.world import StaticMap, World
from pushplan.world.checks import FloatArray, frozen
from pushplan.world.outline import inscribed_radius

_CELL = 0.35  # side of a cell [R]
_MOST_CELLS = 6000
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
        within = needed + standoff_radius(world, i)
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


def standoff_radius(world: World, k: int) -> float:
    """Radius of the disc that stands for an object in the robot's way [m]."""
    return 0.75 * float(world.movables.radii[k])
