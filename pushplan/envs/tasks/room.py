"""Room: the world of a file as an environment, with a goal for the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import shapely

from pushplan.envs.simulators.base import Materials
from pushplan.envs.tasks.base import StepOutcome, Task
from pushplan.envs.tasks.layout import FreeSpace
from pushplan.envs.tasks.materials import BENCHMARK_MATERIALS, TESTBED_MATERIALS
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.geometry.distance_field import geodesic_field
from pushplan.observation import ImageObservation
from pushplan.world import (
    GoalDisc,
    InvalidInputError,
    Movables,
    ScenarioError,
    StaticMap,
    World,
    load_world,
    turtlebot3_burger,
)
from pushplan.world.checked_fields import NonNegativeFloat, PositiveFloat
from pushplan.world.checks import FloatArray
from pushplan.world.outline import transform

WALL_REWARD = -50.0
SUCCESS_REWARD = 200.0
PROGRESS_REWARD = 150.0
_IMAGE_CHANNELS = ("footprint", "movable", "static", "goal_distance")
_CELLS = 200
"""Of the goal distance field, along the longer side of the room."""
_SHORTEST_WAYS = 10.0
_LEAST_TIME = 10.0
_TRIES = 100
_WINDOW = 10.0
"""Side of the image observation, in robot lengths."""


@dataclass(frozen=True)
class RoomPreset:
    """What a world file does not say."""

    materials: Materials  # friction, rolling and heights
    control_step: float = 0.1  # [s]


PRESETS: Mapping[str, RoomPreset] = {
    "benchmark": RoomPreset(BENCHMARK_MATERIALS),
    "testbed": RoomPreset(TESTBED_MATERIALS),
}


@dataclass(frozen=True, kw_only=True)
class RoomVariations(TaskVariations):
    """What may depart from a preset; None leaves the preset's value."""

    task = "room"

    # the world, as `pushplan.world.load_world` reads it; a room of 3 m with two boxes if None
    world_file: str | None = None
    # how far the robot and each object may start from where the file has them, as drawn by the
    # seed [m]; they are turned by as much at their rims
    spread: NonNegativeFloat = 0.0
    # when the episode is cut off [s]; if None after ten times the shortest way at full speed
    time_limit: PositiveFloat | None = None


class RoomTask(Task):
    """The world of a file, with its robot: drive to the goal, moving little.

    Reward of a step: 150 times the decrease of the goal distance, minus 150 times the work on the
    objects over the robot's mass, both as fractions of the way from the file's start; -50 at a
    wall, +200 at the goal. The goal distance is the shortest way of a point around what is static.
    """

    name = "room"
    presets = tuple(PRESETS)
    solid_presets = ("testbed",)
    actions: ClassVar[tuple[str, ...]] = ("velocity", "wheels")
    observations: ClassVar[tuple[str, ...]] = ("image", "state")

    preset: RoomPreset
    preset_table = PRESETS
    variations: RoomVariations
    variation_class = RoomVariations

    def _prepare(self) -> None:
        path = self.variations.world_file
        try:
            world = small_room() if path is None else load_world(path)
            world.navigation_goal  # noqa: B018  objects' goals have tasks of their own
            robot = self.variations.limit(world.robot)
            if self.action == "wheels" and robot.wheel_separation == 0.0:
                raise InvalidInputError(f"robot {robot.name!r} has no wheels (valid: velocity)")
        except InvalidInputError as error:
            raise ScenarioError(f"room: {error}") from error
        self.robot, self.materials = robot, self.preset.materials
        self.control_step = self.variations.control_step or self.preset.control_step
        at_rest = world.movables.moved_to(world.movables.poses)
        self._world = replace(world, robot=robot, movables=at_rest, robot_twist=None, time=0.0)
        room = world.static.bounds[2:] - world.static.bounds[:2]
        self.reach = 2.0 * float(np.hypot(*room))
        self.state_objects = max(self.state_objects, len(world.movables))
        self._field = geodesic_field(
            world.static, world.navigation_goal, resolution=float(room.max()) / _CELLS
        )
        x, y, _ = world.robot_pose.tolist()
        self._way = self._field.exact(x, y)
        if not 0.0 < self._way < math.inf:
            where = "no way leads to the goal" if self._way else "the robot starts in the goal"
            raise ScenarioError(f"room: {where} in {path}")
        limit = self.variations.time_limit
        if limit is None:
            limit = max(_SHORTEST_WAYS * self._way / robot.max_speed, _LEAST_TIME)
        self._most = math.ceil(limit / self.control_step - 1e-9)
        self._steps = 0

    def start(self, rng: np.random.Generator) -> World:
        """The world of the file, with the robot and the objects moved a little if asked for."""
        self._steps = 0
        return self._spread(rng) if self.variations.spread else self._world

    def _spread(self, rng: np.random.Generator) -> World:
        """Bodies moved one after the other, off all others; where nothing is free one stays."""
        world, spread = self._world, self.variations.spread
        free = FreeSpace(world.static)
        movables = world.movables
        outlines = [list(world.robot.contact_parts)]
        outlines += [[movables.outline(k)] for k in range(len(movables))]
        poses = np.vstack([world.robot_pose, movables.poses])
        radii = [world.robot.circumscribed_radius, *movables.radii]
        shapes = [_shape(pose, parts) for pose, parts in zip(poses, outlines, strict=True)]
        for k, parts in enumerate(outlines):
            others = shapely.union_all([shape for i, shape in enumerate(shapes) if i != k])
            for _ in range(_TRIES):
                angle, away, turn = rng.uniform((0.0, 0.0, -1.0), (2.0 * np.pi, 1.0, 1.0))
                shift = spread * math.sqrt(away) * np.array([np.cos(angle), np.sin(angle)])
                pose = poses[k] + np.array([*shift, turn * spread / radii[k]])
                shape = _shape(pose, parts)
                outside = k == 0 and self._is_there(pose)
                if free.is_free(np.array([shape]), 0.0)[0] and not (
                    outside or shape.intersects(others)
                ):
                    poses[k], shapes[k] = pose, shape
                    break
        return world.moved(robot_pose=poses[0], movable_poses=poses[1:])

    def score(
        self, before: World, after: World, *, work: float, touched_static: bool
    ) -> StepOutcome:
        """The reward above; a wall is a failure even where the goal is reached at once."""
        self._steps += 1
        near, far = (self._field.sample(*world.robot_pose[:2]) for world in (after, before))
        costs = far - near - work / self.robot.mass
        reward = PROGRESS_REWARD * costs / self._way
        if touched_static:
            return StepOutcome(reward + WALL_REWARD, False, "wall", True, False)
        if self._is_there(after.robot_pose):
            return StepOutcome(reward + SUCCESS_REWARD, True, "goal", True, False)
        late = self._steps >= self._most
        return StepOutcome(reward, False, "time_limit" if late else "", False, late)

    def _is_there(self, pose: FloatArray) -> bool:
        return self._world.navigation_goal.distance(float(pose[0]), float(pose[1])) == 0.0

    def _image(self, name: str) -> ImageObservation:
        window = _WINDOW * 2.0 * self.robot.circumscribed_radius
        return ImageObservation(channels=_IMAGE_CHANNELS, window=(window, window))


def small_room() -> World:
    """A room of 3 m with a column, two boxes in the way and a TurtleBot3."""
    around = [(0, 0, 3, 0), (3, 0, 3, 3), (3, 3, 0, 3), (0, 3, 0, 0)]
    column = [(1.2, 1.2), (1.8, 1.2), (1.8, 1.8), (1.2, 1.8)]
    static = StaticMap.build(
        polygons=[column], segments=around, radii=0.02, bounds=(0.0, 0.0, 3.0, 3.0)
    )
    corners = np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])
    boxes = Movables.from_outlines(
        [corners, corners], [(1.5, 0.6, 0.0), (2.4, 1.5, 0.3)], masses=[0.1, 0.1]
    )
    return World(
        robot=turtlebot3_burger(),
        robot_pose=np.array((0.6, 0.6, 0.0)),
        static=static,
        movables=boxes,
        goal=GoalDisc(np.array([2.4, 2.4]), 0.2),
    )


def _shape(pose: FloatArray, parts: list[FloatArray]) -> shapely.Geometry:
    return shapely.union_all([shapely.Polygon(transform(pose, part)) for part in parts])
