"""Office: drive from one room of a furnished office to another, past and through boxes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import shapely

from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.room import RoomTask, WorldVariations
from pushplan.geometry.distance_field import sample_values
from pushplan.geometry.grid import Grid, nearest_marked
from pushplan.scenarios import generate_office
from pushplan.scenarios.office import MOST_POLYGONS, office_diagonal
from pushplan.search.grid_dijkstra import grid_dijkstra
from pushplan.world import BUMPERS, World
from pushplan.world.checked_fields import Fraction, Limits, OneOf
from pushplan.world.checks import FloatArray

PRESETS = read_presets("office")
_CELL = 0.15
"""Side of the cells of the goal distance field [m]."""
_CLEARANCE = 0.1
"""Of the ways in that field [m]; walls are then thicker than a move between two cells is long."""


@dataclass(frozen=True, kw_only=True)
class OfficeVariations(WorldVariations):
    """Variations of the Office task; None leaves the preset's value."""

    task = "office"

    polygons: Annotated[int, Limits(100, MOST_POLYGONS)] = 1000  # about how many are static
    # fraction of the doors that have a box in them, and boxes elsewhere for each room
    boxes: Fraction = 0.3
    robot: str | None = None  # one of the preset's robots
    bumper: Annotated[str, OneOf(BUMPERS)] | None = None  # of the robot


class OfficeTask(RoomTask):
    """A random office of `pushplan.scenarios.generate_office`, in which a TurtleBot3 drives.

    Rewards and ends are those of the `RoomTask`. Goal distances come from a grid of 0.15 m and
    moves to the eight cells around, as exact ones take minutes in a large office.
    """

    name = "office"
    presets = tuple(PRESETS)
    observations: ClassVar[tuple[str, ...]] = ("state", "image")

    image_channels = ("footprint", "movable", "static")

    preset_table = PRESETS
    variations: OfficeVariations
    variation_class = OfficeVariations

    def _prepare(self) -> None:
        self._make_robot()
        self.reach = 2.0 * office_diagonal(self.variations.polygons)

    def start(self, rng: np.random.Generator) -> World:
        """A new office, with a start and a goal."""
        wanted = self.variations
        self._world = generate_office(
            rng, robot=self.robot, polygons=wanted.polygons, boxes=wanted.boxes
        )
        self.goal = self._world.goal
        self._grid, self._distances = _goal_distances(self._world)
        self._way = self._robot_distance(self._world)
        return super().start(rng)

    def _robot_distance(self, world: World) -> float:
        x, y = world.robot_pose[:2].tolist()
        left, bottom = self._grid.origin.tolist()
        return sample_values(self._distances, left, bottom, _CELL, x, y)


def _goal_distances(world: World) -> tuple[Grid, FloatArray]:
    """Cells, and the way from each to the goal [m]; from a blocked one that of the nearest free."""
    grid = Grid.cover(world.static.bounds, _CELL)
    x, y = np.meshgrid(grid.x, grid.y)
    walls = shapely.STRtree([shapely.Polygon(polygon) for polygon in world.static.polygons])
    blocked, _ = walls.query(shapely.points(x.ravel(), y.ravel()), "dwithin", _CLEARANCE)
    weights = np.ones(grid.shape)
    weights.ravel()[blocked] = np.inf
    inside = np.flatnonzero(world.navigation_goal.contains(np.stack([x, y], axis=-1)))
    ways, _, _ = grid_dijkstra(weights, inside, np.zeros(grid.shape, dtype=np.bool_), _CELL)
    _, rows, columns = nearest_marked(np.isfinite(ways))
    return grid, ways[rows, columns]
