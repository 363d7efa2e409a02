"""Box-Delivery: push every box into the receptacle in a corner of the room."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import shapely

from pushplan.envs.tasks.layout import those_inside
from pushplan.envs.tasks.manipulation_task import (
    START_TRIES,
    ManipulationTask,
    ManipulationVariations,
)
from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.variations import Yaw
from pushplan.scenarios.rearrangement import rectangle, walls_around
from pushplan.world import Receptacle, StaticMap, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_WAYPOINT_DELIVERY_REWARD = 1.0
_STILL_TURN = 0.02
_COLUMN_TRIES = 20


PRESETS = read_presets("box_delivery")
LAYOUTS = tuple(PRESETS["benchmark"].boxes)


@dataclass(frozen=True, kw_only=True)
class BoxDeliveryVariations(ManipulationVariations):
    """Variations of Box-Delivery; the robot starts anywhere unless ``random_start`` is false."""

    layout: str = "small_empty"
    box_yaw: Yaw = "random"
    random_start: bool = True

    task = "box_delivery"
    layouts = LAYOUTS


class BoxDeliveryTask(ManipulationTask):
    """Box-Delivery, as in the Bench-Push paper (there after Spatial Action Maps, Wu et al. 2020).

    Reward of an action: 0.2 (testbed 0.703) for each metre by which the shortest way of a box's
    centre to the receptacle gets longer or shorter, three times as much where it gets shorter; +10
    for each delivered box (+1 with waypoint actions); -0.25 if the robot touches something static;
    with waypoint actions -0.25 if it does not move.
    """

    name = "box_delivery"
    presets = tuple(PRESETS)
    solid_presets = ("testbed",)
    objects_leave = True
    idle_limits: ClassVar[Mapping[str, int]] = {"heading": 200, "waypoint": 100}
    end = "delivered"
    towards = 3.0

    preset_table = PRESETS
    variation_class = BoxDeliveryVariations

    def _furnish_room(self) -> None:
        if self.action == "waypoint":
            self.done_reward = _WAYPOINT_DELIVERY_REWARD
        length, width = self.preset.rooms[self.variations.layout]
        self.bounds = (-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width)
        side = self.preset.receptacle
        x, y = self.bounds[2:]
        self.goal: Receptacle = Receptacle(rectangle(x - side, y - side, x, y))
        # a box that leans on the wall overlaps it a little: the sides at the walls do not count
        reach = x + 0.5 * self.preset.wall, y + 0.5 * self.preset.wall
        self._mouth = Receptacle(rectangle(x - side, y - side, *reach))
        self.reach = 2.0 * float(np.hypot(length, width))
        self._walls = [*walls_around(self.bounds, self.preset.wall), *self._corners()]
        self._empty = StaticMap.build(polygons=self._walls, bounds=self.bounds)

    def _corners(self) -> list[FloatArray]:
        """Return the pieces that keep boxes from getting stuck in corners without receptacle."""
        x, y = self.bounds[2:]
        return [
            (np.array([x, y]) - np.array(piece)) * (sx, sy)
            for sx, sy in ((-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0))
            for piece in self.preset.corner
        ]

    def _layout(self, rng: np.random.Generator) -> tuple[StaticMap, bool]:
        layout = self.variations.layout
        if layout in self.preset.columns:
            parts = self._columns(rng)
        elif layout == "large_divider":
            parts = self._divider(rng)
        else:
            return self._empty, False
        return StaticMap.build(polygons=[*self._walls, *parts], bounds=self.bounds), True

    def _columns(self, rng: np.random.Generator) -> list[FloatArray]:
        """Between 1 and as many columns as the layout may have; fewer where they do not fit."""
        preset = self.preset
        wanted = int(rng.integers(1, preset.columns[self.variations.layout] + 1))
        margin = preset.column_margin + 0.5 * preset.column
        low = np.array(self.bounds[:2]) + margin
        high = np.array(self.bounds[2:]) - margin
        best: list[FloatArray] = []
        for _ in range(_COLUMN_TRIES):
            placed: list[FloatArray] = []
            for spot in rng.uniform(low, high, (4 * wanted, 2)):
                if all(np.hypot(*(spot - other)) >= preset.column_spacing for other in placed):
                    placed.append(spot)
            if len(placed) > len(best):
                best = placed[:wanted]
            if len(best) == wanted:
                break
        half = 0.5 * preset.column
        return [rectangle(x - half, y - half, x + half, y + half) for x, y in best]

    def _divider(self, rng: np.random.Generator) -> list[FloatArray]:
        """A wall from +x that leaves a gap at -x, with triangles where it meets the wall."""
        fraction, thickness = self.preset.divider
        x0, y0, x1, y1 = self.bounds
        margin = self.preset.divider_margin
        half = 0.5 * thickness
        y = float(rng.uniform(y0 + margin, y1 - margin))
        wall = rectangle(x1 - fraction * (x1 - x0), y - half, x1, y + half)
        corners = ((np.array([x1, y + side * half]), side) for side in (1.0, -1.0))
        return [
            wall,
            *(
                at - np.array(piece) * (1.0, -side)
                for at, side in corners
                for piece in self.preset.corner
            ),
        ]

    def _robot_poses(self, rng: np.random.Generator, static: StaticMap) -> FloatArray:
        low = self.bounds[:2]
        high = self.bounds[2:]
        if self.variations.random_start:
            poses: FloatArray = rng.uniform((*low, -np.pi), (*high, np.pi), (START_TRIES, 3))
            return poses
        margin = max(self.preset.start_margin, 1.2 * self.robot.circumscribed_radius)
        sides = np.linspace(0.0, 0.5 * (high[1] - low[1]) - margin, 12)
        y = np.stack([sides, -sides], axis=1).ravel()
        return np.column_stack([np.full_like(y, low[0] + margin), y, np.zeros_like(y)])

    def _box_region(self) -> tuple[FloatArray, list[Any]]:
        return np.array(self.bounds), [shapely.Polygon(self.goal.polygon)]

    def leaving(self, ids: IntArray, poses: FloatArray) -> IntArray:
        """Boxes with all corners inside the receptacle."""
        if not len(ids):
            return ids
        return those_inside(self._mouth, self._start, ids, poses)

    def _measure(self, world: World) -> tuple[FloatArray, BoolArray]:
        distances = np.zeros(self.box_count)
        done = np.ones(self.box_count, dtype=bool)
        distances[world.movables.ids] = self.goal_distances(world.movables.poses)
        done[world.movables.ids] = False
        return distances, done

    def _is_still(self, before: World, after: World) -> bool:
        if self.action != "waypoint":
            return False
        dx, dy, turn = (after.robot_pose - before.robot_pose).tolist()
        turned = abs(np.remainder(turn + np.pi, 2.0 * np.pi) - np.pi)
        return bool(np.hypot(dx, dy) < self.preset.still and turned < _STILL_TURN)
