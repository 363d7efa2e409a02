"""Room: the world of a file as an environment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import shapely

from pushplan.envs.simulators.base import Materials
from pushplan.envs.tasks.base import StepOutcome, Task
from pushplan.envs.tasks.layout import FreeSpace
from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.room_goals import ObjectsGoal, RobotGoal
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.geometry.distance_field import geodesic_field
from pushplan.observation import ImageObservation
from pushplan.world import (
    ClearanceArea,
    InvalidInputError,
    Receptacle,
    ScenarioError,
    World,
    load_world,
)
from pushplan.world.checked_fields import NonNegativeFloat, PositiveFloat
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.outline import transform

_IMAGE_CHANNELS = ("footprint", "movable", "static", "goal_distance")
_CELLS = 200
"""Of the goal distance field, along the longer side of the room."""
_SHORTEST_WAYS = 10.0
_LEAST_TIME = 10.0
_TRIES = 100
SMALL_ROOM = Path(__file__).with_suffix(".yaml")
"""A room of 3 m with a column, two boxes in the way and a TurtleBot3."""
_WINDOW = 10.0
"""Side of the image observation, in robot lengths."""


@dataclass(frozen=True)
class RoomPreset:
    """What a world file does not say."""

    materials: Materials  # friction, rolling and heights
    control_step: float = 0.1  # [s]


PRESETS: Mapping[str, RoomPreset] = read_presets("room", RoomPreset)


@dataclass(frozen=True, kw_only=True)
class RoomVariations(TaskVariations):
    """What may depart from a preset; None leaves the preset's value."""

    task = "room"

    # the world, as `pushplan.world.load_world` reads it; a room of 3 m with two boxes if None
    world_file: str | None = None
    # how far the robot and each object may start from where the file has them, as drawn by the
    # seed [m]; they are turned by as much at their rims
    spread: NonNegativeFloat = 0.0
    # when the episode is cut off [s]; if None after ten times the shortest way at full speed, for
    # goals of objects after ten times the sum of their ways
    time_limit: PositiveFloat | None = None
    # when it is cut off after the last object that was done [s]; never if None
    idle_limit: PositiveFloat | None = None
    # friction coefficients between robot and objects, two objects, objects and walls
    bumper_friction: NonNegativeFloat | None = None
    object_friction: NonNegativeFloat | None = None
    wall_friction: NonNegativeFloat | None = None


class RoomTask(Task):
    """The world of a file, with its robot and its goal, of any kind.

    `RobotGoal` and `ObjectsGoal` say what the reward is and when an episode ends; goal distances
    are shortest ways of a point around what is static.
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
            world = load_world(SMALL_ROOM if path is None else path)
            self._drive(world.robot)
            robot = self.robot
            if self.action == "wheels" and robot.wheel_separation == 0.0:
                raise InvalidInputError(f"robot {robot.name!r} has no wheels (valid: velocity)")
        except InvalidInputError as error:
            raise ScenarioError(f"room: {error}") from error
        at_rest = world.movables.moved_to(world.movables.poses)
        self._world = replace(world, robot=robot, movables=at_rest, robot_twist=None, time=0.0)
        room = world.static.bounds[2:] - world.static.bounds[:2]
        self.reach = 2.0 * float(np.hypot(*room))
        self.state_objects = max(self.state_objects, len(world.movables))
        field = geodesic_field(world.static, world.goal, resolution=float(room.max()) / _CELLS)
        of_objects = isinstance(world.goal, Receptacle | ClearanceArea)
        goal_of = ObjectsGoal if of_objects else RobotGoal
        self._goal: RobotGoal | ObjectsGoal = goal_of(self._world, field)
        self.goal_kind = self._goal.kind
        self.objects_leave = isinstance(world.goal, Receptacle)
        way = self._goal.way
        if self._goal.is_done or way == math.inf:
            who = "every object starts" if of_objects else "the robot starts"
            where = f"{who} in the goal" if self._goal.is_done else "no way leads to the goal"
            raise ScenarioError(f"room: {where} in {path}")
        limit = self.variations.time_limit
        if limit is None:
            limit = max(_SHORTEST_WAYS * way / robot.max_speed, _LEAST_TIME)
        self._most = math.ceil(limit / self.control_step - 1e-9)
        self._steps, self._idle_since, self._done = 0, 0, 0

    def start(self, rng: np.random.Generator) -> World:
        """The world of the file, with the robot and the objects moved a little if asked for."""
        self._steps, self._idle_since, self._done = 0, 0, 0
        return self._spread(rng) if self.variations.spread else self._world

    def _spread(self, rng: np.random.Generator) -> World:
        """Bodies moved one after the other, off all others, on the same side of the walls.

        Where nothing is free one stays.
        """
        world, spread = self._world, self.variations.spread
        free, floor = FreeSpace(world.static), shapely.box(*world.static.bounds)
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
                if k == 0 and self._is_goal(pose):
                    continue
                way = shapely.LineString([poses[k][:2], pose[:2]])  # it is not across a wall
                if (
                    floor.covers(shape)
                    and free.is_free(np.array([shape, way]), 0.0).all()
                    and not shape.intersects(others)
                ):
                    poses[k], shapes[k] = pose, shape
                    break
        return world.moved(robot_pose=poses[0], movable_poses=poses[1:])

    def score(
        self, before: World, after: World, *, work: float, touched_static: bool
    ) -> StepOutcome:
        """What the goal says, and the limits of time."""
        self._steps += 1
        outcome = self._goal.score(before, after, work, touched_static)
        done = 0 if outcome.completed is None else int(outcome.completed.sum())
        if done > self._done:
            self._idle_since = self._steps
        self._done = done
        if outcome.terminated:
            return outcome
        if self._steps >= self._most:
            return replace(outcome, reason="time_limit", truncated=True)
        idle, limit = self._steps - self._idle_since, self.variations.idle_limit
        if limit is not None and idle * self.control_step >= limit * (1.0 - 1e-9):
            return replace(outcome, reason="no_progress", truncated=True)
        return outcome

    def leaving(self, ids: IntArray, poses: FloatArray) -> IntArray:
        """Objects in the receptacle, where the goal is one."""
        assert isinstance(self._goal, ObjectsGoal)
        return self._goal.leaving(ids, poses)

    def _is_goal(self, pose: FloatArray) -> bool:
        return isinstance(self._goal, RobotGoal) and self._goal.is_there(pose)

    @classmethod
    def goal_kind_of(cls, variations: Mapping[str, object]) -> Literal["robot", "objects"]:
        """As the file has it; the robot's where it cannot be read."""
        path = variations.get("world_file")
        try:
            goal = None if path is None else load_world(str(path)).goal
        except InvalidInputError:
            return cls.goal_kind
        return "objects" if isinstance(goal, Receptacle | ClearanceArea) else "robot"

    def _image(self, name: str) -> ImageObservation:
        window = _WINDOW * 2.0 * self.robot.circumscribed_radius
        return ImageObservation(channels=_IMAGE_CHANNELS, window=(window, window))


def _shape(pose: FloatArray, parts: list[FloatArray]) -> shapely.Geometry:
    return shapely.union_all([shapely.Polygon(transform(pose, part)) for part in parts])
