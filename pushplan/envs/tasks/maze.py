"""Maze: drive to the goal through a U- or Z-shaped way with boxes in it, moving them little."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
import shapely

from pushplan.envs.tasks.base import StepOutcome, Task
from pushplan.envs.tasks.layout import GAP, FreeSpace, footprint_at, place_boxes
from pushplan.envs.tasks.presets import Preset, read_presets
from pushplan.envs.tasks.variations import Objects, TaskVariations, Yaw
from pushplan.geometry.distance_field import GeodesicField, geodesic_field
from pushplan.observation import ImageObservation
from pushplan.scenarios.rearrangement import rectangle, walls_around
from pushplan.world import BUMPERS, GoalDisc, ScenarioError, StaticMap, World
from pushplan.world.checked_fields import NonNegativeInt, OneOf, PositiveFloat
from pushplan.world.checks import FloatArray

_IMAGE_CHANNELS = ("footprint", "movable", "static", "goal_distance")
_START_TRIES = 2000


PRESETS = read_presets("maze")


def walls(preset: Preset, shape: str) -> StaticMap:
    """The walls around the room and inside it, which make the way a U or a Z."""
    width, length = preset.rooms[shape]
    half = preset.wall
    bounds = (0.0, 0.0, width, length)
    if preset.thick_lines:
        around = [
            (0.0, 0.0, width, 0.0),
            (width, 0.0, width, length),
            (width, length, 0.0, length),
            (0.0, length, 0.0, 0.0),
        ]
        lines = [(x, low, x, high) for x, low, high in preset.inner[shape]]
        return StaticMap.build(segments=[*around, *lines], radii=half, bounds=bounds)
    inside = [rectangle(x - half, low, x + half, high) for x, low, high in preset.inner[shape]]
    return StaticMap.build(polygons=[*walls_around(bounds, 2.0 * half), *inside], bounds=bounds)


@dataclass(frozen=True, kw_only=True)
class MazeVariations(TaskVariations):
    """Variations of the Maze task; None leaves the preset's value."""

    task = "maze"

    shape: Annotated[str, OneOf(("u", "z"))] = "u"  # ``"u"`` or ``"z"``
    boxes: NonNegativeInt = 5  # number of boxes
    box_size: PositiveFloat | None = None  # side of the boxes [m]
    objects: Objects = "boxes"  # shapes: ``"boxes"``, or ``"many"`` of them
    # headings of the boxes at the start, ``"aligned"`` with the walls or ``"random"``
    box_yaw: Yaw = "aligned"
    # True if the robot starts anywhere instead of at the preset's start
    random_start: bool | None = None
    touching: bool | None = None  # True if boxes may start in touch with the robot
    robot: str | None = None  # one of the preset's robots, or one of a user's
    # bumper in front of the testbed's robot, one of `pushplan.world.BUMPERS`
    bumper: Annotated[str, OneOf(BUMPERS)] | None = None
    time_limit: PositiveFloat | None = None  # when the episode is cut off [s]


class MazeTask(Task):
    """The maze, as in the Bench-Push paper.

    Reward of a step: ``progress_reward`` times the decrease of the normalised goal distance,
    minus ``work_reward`` times the work on the boxes; -50 at a wall, +200 at the goal. The goal
    distance is the shortest way of a point around the walls to the goal disc, divided by its
    greatest finite value in the maze, so a whole way pays at most ``progress_reward``.
    """

    name = "maze"
    presets = tuple(PRESETS)
    solid_presets = ("testbed",)
    actions: ClassVar[tuple[str, ...]] = ("turn_rate", "wheels", "velocity", "omnidirectional")
    observations: ClassVar[tuple[str, ...]] = ("image", "state")

    preset_table = PRESETS
    variations: MazeVariations
    variation_class = MazeVariations

    def _prepare(self) -> None:
        self._make_robot()
        self._lay_out()

    def _lay_out(self) -> None:
        """Set the walls and the goal, which are the same in every start."""
        shape = self.variations.shape
        self.static = walls(self.preset, shape)
        self.goal = GoalDisc(
            np.array(self.preset.goals[shape]), self.preset.goal_radius + self.preset.robot_radius
        )
        self._free_space = FreeSpace(self.static)
        room = self.static.bounds[2:] - self.static.bounds[:2]
        self.reach = 2.0 * float(np.hypot(*room))
        self.state_objects = max(self.state_objects, self.variations.boxes)

    @property
    def box_size(self) -> float:
        """Side of the boxes [m]."""
        return float(self.variations.box_size or self.preset.box_size)

    @cached_property
    def field(self) -> GeodesicField:
        """Distance of a point to the goal disc around the walls [m]."""
        return geodesic_field(self.static, self.goal, resolution=self.preset.field_resolution)

    @cached_property
    def _farthest(self) -> float:
        return float(self.field.values[np.isfinite(self.field.values)].max())

    def start(self, rng: np.random.Generator) -> World:
        """A new start: the robot, then boxes off it, off each other, the walls and the goal."""
        self._steps = 0
        pose = self._start_pose(rng)
        boxes = place_boxes(
            self._free_space,
            rng,
            self.variations.boxes,
            self.box_size,
            footprint_at(self.robot, pose),
            preset=self.preset,
            wanted=self.variations,
            keep_off=[(shapely.Point(self.goal.center), self.goal.radius)],
        )
        return World(
            robot=self.robot,
            robot_pose=pose,
            static=self.static,
            movables=boxes,
            goal=self.goal,
        )

    def _start_pose(self, rng: np.random.Generator) -> FloatArray:
        """The preset's start, or a random one from which the robot can get away.

        A random start is clear of the walls, outside the goal, joined to the goal by a way for
        the robot's inscribed disc, and not doomed: at full speed the robot can turn by a right
        angle to one side at least without touching a wall. That holds whatever the action is, so
        that a seed is the same start for all of them.
        """
        random = self.variations.random_start
        if not (self.preset.random_start if random is None else random):
            return np.array(self.preset.starts[self.variations.shape])
        reachable = geodesic_field(
            self.static,
            self.goal,
            resolution=self.preset.field_resolution,
            clearance=self.robot.inscribed_radius,
        )
        low = [*self.static.bounds[:2], -np.pi]
        high = [*self.static.bounds[2:], np.pi]
        for _ in range(_START_TRIES):
            pose = rng.uniform(low, high)
            row, col = reachable.grid.cell(pose[0], pose[1])
            outside = self.goal.distance(pose[0], pose[1]) > 0.0
            if outside and np.isfinite(reachable.values[row, col]) and self._can_leave(pose):
                return pose
        raise ScenarioError("maze: no free start was found from which the goal can be reached")

    def _can_leave(self, pose: FloatArray) -> bool:
        angles = np.linspace(0.0, np.pi / 2.0, 13)
        for side in (1.0, -1.0):
            radius = side * self.robot.turning_radius
            center = pose[:2] + radius * np.array([-np.sin(pose[2]), np.cos(pose[2])])
            headings = pose[2] + side * angles
            around = np.stack([np.sin(headings), -np.cos(headings)], axis=1)
            places = np.column_stack([center + radius * around, headings])
            shapes = [part for place in places for part in footprint_at(self.robot, place)]
            if self._free_space.is_free(np.array(shapes), GAP * self.box_size).all():
                return True
        return False

    def score(
        self, before: World, after: World, *, work: float, touched_static: bool
    ) -> StepOutcome:
        """The reward above; a wall is a failure even where the goal is reached at once."""
        x0, y0, _ = before.robot_pose.tolist()
        x1, y1, _ = after.robot_pose.tolist()
        progress = (self.field.sample(x0, y0) - self.field.sample(x1, y1)) / self._farthest
        reward = self.preset.progress_reward * progress - self.preset.work_reward * work
        return self._driven(reward, after, failure="wall" if touched_static else "")

    def _image(self, name: str) -> ImageObservation:
        window = self.preset.window
        return ImageObservation(channels=_IMAGE_CHANNELS, window=(window, window))
