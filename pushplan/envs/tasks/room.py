"""Room: the world of a file as an environment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import shapely

from pushplan.envs.tasks.base import SUCCESS_REWARD, StepOutcome, Task
from pushplan.envs.tasks.layout import FreeSpace, GoalWays, those_inside
from pushplan.envs.tasks.presets import read_presets
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.geometry.distance_field import geodesic_field
from pushplan.observation import ImageObservation
from pushplan.world import (
    Drive,
    InvalidInputError,
    Receptacle,
    ScenarioError,
    World,
    load_world,
)
from pushplan.world.checked_fields import NonNegativeFloat, PositiveFloat
from pushplan.world.checks import BoolArray, FloatArray, IntArray
from pushplan.world.outline import grown_outline, transform

DONE_REWARD = 10.0
PROGRESS_REWARD = 150.0
_LEAN = 0.02
"""Tolerance by which a corner may be outside a receptacle, as a fraction of the object's radius: an
object that leans on a wall overlaps it a little."""
_CELLS = 200
"""Of the goal distance field, along the longer side of the room."""
_SHORTEST_WAYS = 10.0
_LEAST_TIME = 10.0
_TRIES = 100
SMALL_ROOM = Path(__file__).with_suffix(".yaml")
"""A room of 3 m with a column, two boxes in the way and a TurtleBot3."""
_WINDOW = 10.0
"""Side of the image observation, in robot lengths."""


PRESETS = read_presets("room")


@dataclass(frozen=True, kw_only=True)
class WorldVariations(TaskVariations):
    """Variations of tasks in a given world; None leaves the preset's value."""

    # greatest distance of robot and objects from where the world has them, as drawn by the
    # seed [m]; they are turned by as much at their rims
    spread: NonNegativeFloat = 0.0
    # when the episode is cut off [s]; if None after ten times the shortest way at full speed, for
    # goals of objects after ten times the sum of their ways
    time_limit: PositiveFloat | None = None
    # when it is cut off after the last object that was done [s]; never if None
    idle_limit: PositiveFloat | None = None


@dataclass(frozen=True, kw_only=True)
class RoomVariations(WorldVariations):
    """Variations of the Room task; None leaves the preset's value."""

    task = "room"

    # the world, as `pushplan.world.load_world` reads it; a room of 3 m with two boxes if None
    world_file: str | None = None


class RoomTask(Task):
    """The world of a file, with its robot and its goal, of any kind.

    A robot drives to a disc or over a line. Reward: 150 times the decrease of its goal distance,
    minus 150 times the work on the objects over the robot's mass, both as fractions of the way from
    the file's start; -50 at a wall or beyond the bounds of the map, +200 at the goal.

    Every object goes into a receptacle, where it leaves the floor, off an area, or to a place of
    its own. Reward: 150 times the decrease of the objects' goal distances, as a fraction of those
    at the file's start; +10 for each object that is done and -10 for each that is no longer, +200
    when all are.

    Goal distances are shortest ways of a point around what is static.
    """

    name = "room"
    presets = tuple(PRESETS)
    solid_presets = ("testbed",)
    actions: ClassVar[tuple[str, ...]] = ("velocity", "wheels", "omnidirectional")
    observations: ClassVar[tuple[str, ...]] = ("image", "state")

    image_channels: tuple[str, ...] = ("footprint", "movable", "static", "goal_distance")

    preset_table = PRESETS
    variations: WorldVariations
    variation_class: ClassVar[type[WorldVariations]] = RoomVariations

    def _prepare(self) -> None:
        assert isinstance(self.variations, RoomVariations)
        path = self.variations.world_file
        try:
            world = load_world(SMALL_ROOM if path is None else path)
            robot = world.robot
            if self.action == "omnidirectional":
                drive = Drive.OMNIDIRECTIONAL
                robot = replace(robot, drive=drive, min_turning_radius=0.0)
            self._drive(robot)
            robot = self.robot
            if self.action == "wheels" and robot.wheel_separation == 0.0:
                raise InvalidInputError(f"robot {robot.name!r} has no wheels (valid: velocity)")
        except InvalidInputError as error:
            raise ScenarioError(f"room: {error}") from error
        objects = world.movables.moved_to(world.movables.poses)  # at rest
        self._furnish(replace(world, robot=robot, movables=objects, robot_twist=None, time=0.0))
        if self._is_done:
            who = "the robot" if self.goal_kind == "robot" else "every object"
            raise ScenarioError(f"room: {who} starts in the goal in {path}")
        if self._way == math.inf:
            raise ScenarioError(f"room: no way leads to the goal in {path}")

    def _furnish(self, world: World) -> None:
        """Set the world of the starts, and all that follows from it."""
        self._world = world
        objects = world.movables
        room = world.static.bounds[2:] - world.static.bounds[:2]
        self.reach = 2.0 * float(np.hypot(*room))
        self._far = float(room.sum())
        self.state_objects = max(self.state_objects, len(objects))
        self.goal = world.goal
        self.objects_leave = isinstance(world.goal, Receptacle)
        self.goal_kind = world.goal_kind
        cell = float(room.max()) / _CELLS
        if self.goal_kind == "objects":
            self._ways = GoalWays(world.static, world.manipulation_goal, cell)
            self._way = self._way_of_objects()
            self._is_done = world.goal_reached
        else:
            self._field = geodesic_field(world.static, world.goal, resolution=cell)
            self._way = self._field.exact(*world.robot_pose[:2].tolist())
            self._is_done = self._way == 0.0
        self._idle_since = 0

    def _way_of_objects(self) -> float:
        """Summed goal distance of the objects at the file's start [m], inf where none has a way."""
        objects = self._world.movables
        if not len(objects):
            raise ScenarioError("room: a goal for objects needs an object, the world has none")
        if isinstance(self.goal, Receptacle):
            lean = _LEAN * float(objects.radii.min())
            self._mouth = Receptacle(grown_outline(self.goal.polygon, lean))
        ways = self._ways.lengths(objects.ids, objects.poses)
        if not np.isfinite(ways[self._world.wanted]).any():
            return math.inf
        # 1 m where all centres are there already, but not all corners
        return self._distance(self._world) or 1.0

    def _distance(self, world: World) -> float:
        """Summed goal distance of the objects on the floor [m]."""
        ways = self._ways.lengths(world.movables.ids, world.movables.poses)
        return float(np.minimum(ways, self._far).sum())

    @property
    def _longest(self) -> float:
        return max(_SHORTEST_WAYS * self._way / self.robot.max_speed, _LEAST_TIME)

    def start(self, rng: np.random.Generator) -> World:
        """The world, with the robot and the objects moved a little if asked for."""
        self._steps = 0
        self._idle_since = 0
        return self._spread(rng) if self.variations.spread else self._world

    def _spread(self, rng: np.random.Generator) -> World:
        """Bodies moved one after the other, off all others, on the same side of the walls.

        Where nothing is free one stays.
        """
        world = self._world
        spread = self.variations.spread
        free = FreeSpace(world.static)
        floor = shapely.box(*world.static.bounds)
        movables = world.movables
        outlines = [list(world.robot.contact_parts)]
        outlines += [list(movables.parts(k)) for k in range(len(movables))]
        poses = np.vstack([world.robot_pose, movables.poses])
        of_objects = self.goal_kind == "objects"
        radii = [world.robot.circumscribed_radius, *movables.radii]
        shapes = [_shape(pose, parts) for pose, parts in zip(poses, outlines, strict=True)]
        for k, parts in enumerate(outlines):
            others = shapely.union_all([shape for i, shape in enumerate(shapes) if i != k])
            for _ in range(_TRIES):
                angle, away, turn = rng.uniform((0.0, 0.0, -1.0), (2.0 * np.pi, 1.0, 1.0))
                shift = spread * math.sqrt(away) * np.array([np.cos(angle), np.sin(angle)])
                pose = poses[k] + np.array([*shift, turn * spread / radii[k]])
                shape = _shape(pose, parts)
                if k == 0 and not of_objects and world.navigation_goal.distance(*pose[:2]) == 0.0:
                    continue
                way = shapely.LineString([poses[k][:2], pose[:2]])  # it is not across a wall
                if (
                    floor.covers(shape)
                    and free.is_free(np.array([shape, way]), 0.0).all()
                    and not shape.intersects(others)
                ):
                    poses[k] = pose
                    shapes[k] = shape
                    break
        return world.moved(robot_pose=poses[0], movable_poses=poses[1:])

    def score(
        self, before: World, after: World, *, work: float, touched_static: bool
    ) -> StepOutcome:
        """The reward above; walls end it only where the robot has the goal."""
        if self.goal_kind == "objects":
            return self._score_objects(before, after)
        closer = self._robot_distance(before) - self._robot_distance(after)
        reward = PROGRESS_REWARD * (closer - work / self._world.robot.mass) / self._way
        at = after.robot_pose[:2]
        bounds = self._world.static.bounds
        failure = "wall" if touched_static else ""
        if not failure and ((at < bounds[:2]).any() or (at > bounds[2:]).any()):
            failure = "left_map"
        return self._checked_for_time(self._driven(reward, after, failure=failure))

    def _robot_distance(self, world: World) -> float:
        """Goal distance of the robot [m]."""
        return self._field.sample(*world.robot_pose[:2])

    def _score_objects(self, before: World, after: World) -> StepOutcome:
        self._steps += 1
        was_done = self._done(before)
        done = self._done(after)
        gained = int(done.sum()) - int(was_done.sum())
        if gained > 0:
            self._idle_since = self._steps
        closer = self._distance(before) - self._distance(after)
        reward = PROGRESS_REWARD * closer / self._way + DONE_REWARD * gained
        if done.all() and after.goal_reached:
            return StepOutcome(reward + SUCCESS_REWARD, True, "done", True, False, done)
        late = self._steps >= self._max_steps
        outcome = StepOutcome(reward, False, "time_limit" if late else "", False, late, done)
        return self._checked_for_time(outcome)

    def _done(self, world: World) -> BoolArray:
        """Flags of the objects of the start that are done: that have left the floor, or are off."""
        done = ~np.isin(self._world.movables.ids, world.movables.ids)
        if not self.objects_leave:
            done[~done] = world.completed
        return done

    def _checked_for_time(self, outcome: StepOutcome) -> StepOutcome:
        """The outcome, cut off after too long without progress."""
        idle = self._steps - self._idle_since
        limit = self.variations.idle_limit
        if outcome.reason or limit is None or idle * self.control_step < limit * (1.0 - 1e-9):
            return outcome
        return replace(outcome, reason="no_progress", truncated=True)

    def leaving(self, ids: IntArray, poses: FloatArray) -> IntArray:
        """Objects in the receptacle, where the goal is one."""
        return those_inside(self._mouth, self._world.movables, ids, poses)

    @classmethod
    def goal_kind_of(cls, variations: Mapping[str, object]) -> Literal["robot", "objects"]:
        """As the file has it; the robot's where it cannot be read."""
        path = variations.get("world_file")
        if path is None:
            return cls.goal_kind
        try:
            return load_world(str(path)).goal_kind
        except InvalidInputError:
            return cls.goal_kind

    def _image(self, name: str) -> ImageObservation:
        window = _WINDOW * 2.0 * self.robot.circumscribed_radius
        return ImageObservation(channels=self.image_channels, window=(window, window))


def _shape(pose: FloatArray, parts: list[FloatArray]) -> shapely.Geometry:
    return shapely.union_all([shapely.Polygon(transform(pose, part)) for part in parts])
