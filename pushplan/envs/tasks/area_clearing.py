"""Area-Clearing: push every box out of an area, across the edges of it that are open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import shapely

from pushplan.envs.tasks.layout import FreeSpace, squares
from pushplan.envs.tasks.manipulation_task import (
    START_TRIES,
    ManipulationTask,
    ManipulationVariations,
)
from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.variations import Yaw
from pushplan.scenarios.rearrangement import rectangle, walls_around
from pushplan.world import ClearanceArea, ScenarioError, StaticMap, World
from pushplan.world.checks import BoolArray, FloatArray

PRESETS = read_presets("area_clearing")
LAYOUTS = tuple(PRESETS["benchmark"].boxes)


@dataclass(frozen=True, kw_only=True)
class AreaClearingVariations(ManipulationVariations):
    """Variations of Area-Clearing; ``random_start`` draws where along the edge the robot starts."""

    layout: str = "clear"
    box_yaw: Yaw = "aligned"
    random_start: bool = False

    task = "area_clearing"
    layouts = LAYOUTS


class AreaClearingTask(ManipulationTask):
    """Area-Clearing, as in the Bench-Push paper.

    Reward of an action: 0.2 (testbed 2.5) for each metre by which the shortest way of a box's
    centre to an open edge of the area gets shorter, the same as a penalty where it gets longer; +10
    for each box that is cleared and -10 for each that has come back; -0.25 if the robot touches
    something static; +50 when the area is clear.
    """

    name = "area_clearing"
    presets = tuple(PRESETS)
    solid_presets = ("testbed",)
    idle_limits: ClassVar[Mapping[str, int]] = {"heading": 200, "waypoint": 200}
    end = "cleared"
    back_reward = -10.0
    end_reward = 50.0

    preset_table = PRESETS
    variation_class = AreaClearingVariations

    def _furnish_room(self) -> None:
        self._room = self.preset.layouts[self.variations.layout]
        self.static = self._static()
        half_x, half_y = self._room["area"]
        polygon = rectangle(-half_x, -half_y, half_x, half_y)
        edges = open_edges(self.static, polygon, self.box_size)
        if not edges.any():
            raise ScenarioError(
                f"area_clearing: boxes of {self.box_size:g} m fit through no edge of the area in "
                f"layout {self.variations.layout!r}; ask for smaller boxes"
            )
        self.goal: ClearanceArea = ClearanceArea(polygon, edges)
        self.reach = 4.0 * float(np.hypot(*self._room["outer"]))

    def _static(self) -> StaticMap:
        """Walls around the room and beside the area, and columns; always the same."""
        room = self._room
        column = 0.5 * self.preset.column
        x, y = room["outer"]
        parts = list(walls_around((-x, -y, x, y), self.preset.wall))
        half = 0.5 * self.preset.inner_wall
        top = room["area"][1]
        parts += [rectangle(side - half, -top, side + half, top) for side in room["walls"]]
        parts += [
            rectangle(a - column, b - column, a + column, b + column) for a, b in room["columns"]
        ]
        return StaticMap.build(polygons=parts, bounds=(-x, -y, x, y))

    def _layout(self, rng: np.random.Generator) -> tuple[StaticMap, bool]:
        return self.static, False

    def _robot_poses(self, rng: np.random.Generator, static: StaticMap) -> FloatArray:
        margin = self.preset.start_margin
        half = self._room["area"][0]
        # lower where something stands in front, such as a column
        y = margin * np.linspace(1.0, -1.0, 9) - self._room["area"][1]
        x = np.zeros(1)
        if self.variations.random_start:
            x = rng.uniform(margin - half, half - margin, START_TRIES // len(y))
        poses = np.full((len(x) * len(y), 3), 0.5 * np.pi)
        poses[:, 0] = np.repeat(x, len(y))
        poses[:, 1] = np.tile(y, len(x))
        return poses

    def _box_region(self) -> tuple[FloatArray, list[Any]]:
        margin = self.preset.box_margin
        x, y = (half - margin for half in self._room["area"])
        return np.array([-x, -y, x, y]), []

    def _measure(self, world: World) -> tuple[FloatArray, BoolArray]:
        return self.goal_distances(world.movables.poses), world.completed


def open_edges(static: StaticMap, polygon: FloatArray, size: float) -> BoolArray:
    """Find the edges of an area across which a box can be pushed out.

    An edge is open if somewhere along it a box that has just left, with a side on the edge, would
    overlap nothing static and lie within the map's bounds.

    Args:
        static: walls and columns.
        polygon: (N, 2) corners of the area [m], counter-clockwise.
        size: side of the boxes [m].

    Returns:
        (N,) flags for the edges from corner i to i + 1.
    """
    free_space = FreeSpace(static)
    bounds = static.bounds
    found = np.zeros(len(polygon), dtype=bool)
    for i, (a, b) in enumerate(zip(polygon, np.roll(polygon, -1, axis=0), strict=True)):
        length = float(np.hypot(*(b - a)))
        along = (b - a) / length
        outward = np.array([along[1], -along[0]])
        steps = np.linspace(0.0, length, max(2, int(4.0 * length / size)))
        centres = a + steps[:, None] * along + 0.5 * size * outward
        heading = np.full(len(steps), np.arctan2(along[1], along[0]))
        corners = squares(np.column_stack([centres, heading]), size)
        inside = ((corners >= bounds[:2]) & (corners <= bounds[2:])).all(axis=(1, 2))
        shapes = shapely.polygons(corners)
        found[i] = bool((free_space.is_free(shapes, 1e-9) & inside).any())
    return found
