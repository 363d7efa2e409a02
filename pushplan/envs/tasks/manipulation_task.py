"""Common base of Box-Delivery and Area-Clearing: a room, a robot, and boxes to push."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from pushplan.envs.tasks.base import StepOutcome, Task
from pushplan.envs.tasks.layout import GAP, FreeSpace, footprint_at, place_boxes
from pushplan.envs.tasks.variations import Objects, TaskVariations, Yaw
from pushplan.geometry import GeodesicField, Grid, clearance_field, geodesic_field
from pushplan.geometry.free_components import FreeComponents
from pushplan.geometry.grid import nearest_marked
from pushplan.observation import ImageObservation
from pushplan.world import (
    BUMPERS,
    AreaGoal,
    InvalidInputError,
    ScenarioError,
    StaticMap,
    World,
)
from pushplan.world.checked_fields import OneOf, PositiveFloat, PositiveInt
from pushplan.world.checks import BoolArray, FloatArray, IntArray, choice

LEAST_SIZE = 0.01
"""Least size of boxes, as a fraction of the preset's."""
_CHANNELS = ("occupancy", "footprint", "robot_distance", "goal_distance")
_PIXELS = {"image": 224, "spatial": 96}
_LAYOUT_TRIES = 8
START_TRIES = 2000
STATIC_REWARD = -0.25
STILL_REWARD = -0.25


@dataclass(frozen=True, kw_only=True)
class ManipulationVariations(TaskVariations):
    """Variations of a manipulation task; None leaves the preset's value."""

    layout: str  # name of the layout
    boxes: PositiveInt | None = None  # number of boxes, at least 1
    # side of the boxes [m], at least 1 % of the preset's; their least spacing grows with it
    box_size: PositiveFloat | None = None
    objects: Objects = "boxes"  # shapes: ``"boxes"``, or ``"many"`` of them
    box_yaw: Yaw  # headings of the boxes at the start, ``"aligned"`` or ``"random"``
    robot: str | None = None  # one of the preset's robots, or one of a user's
    # one of `pushplan.world.BUMPERS`, where the robot's can be changed
    bumper: Annotated[str, OneOf(BUMPERS)] | None = None
    random_start: bool  # True for a random start of the robot
    touching: bool | None = None  # True if boxes may start in touch with the robot
    # time without progress after which the episode is cut off [s], whatever the action mode
    idle_limit: PositiveFloat | None = None

    layouts: ClassVar[tuple[str, ...]]

    def __post_init__(self) -> None:
        super().__post_init__()
        choice("layout", self.layout, self.layouts)


@dataclass(frozen=True)
class Reach:
    """The connected free space of a disc-shaped robot around one point."""

    grid: Grid  # place of the cells
    # (rows, columns) distance of each cell to the nearest place where the robot's centre can be [m]
    distances: FloatArray

    @classmethod
    def around(cls, static: StaticMap, point: FloatArray, radius: float, resolution: float) -> Self:
        """The free space of a disc of ``radius`` [m] whose nearest part is nearest to ``point``.

        Args:
            static: obstacles; the map's bounds are where the grid ends.
            point: (2,) [m].
            radius: of the robot [m].
            resolution: side of a cell [m].
        """
        grid, labels, nearest = _components(static, radius, resolution)
        row, col = _cells(grid, point[None])
        wanted = labels[tuple(nearest[:, row, col])][0]
        if wanted == 0:  # the robot fits nowhere
            return cls(grid, np.full(grid.shape, np.inf))
        return cls(grid, nearest_marked(labels == wanted)[0] * resolution)

    def within(self, points: FloatArray, distance: float) -> BoolArray:
        """Check which points (N, 2) [m] are at most ``distance`` [m] from where the robot fits."""
        near: BoolArray = self.distances[_cells(self.grid, points)] <= distance
        return near


@lru_cache(maxsize=8)
def _components(static: StaticMap, radius: float, resolution: float) -> tuple[Grid, IntArray, Any]:
    """The grid, the number of each cell's free component (0: none), the nearest free cell."""
    grid = Grid.cover(static.bounds, resolution)
    labels = FreeComponents.of(grid, clearance_field(static, grid), radius).labels
    _, *nearest = nearest_marked(labels != 0)
    return grid, labels, np.stack(nearest)


def _cells(grid: Grid, points: FloatArray) -> tuple[IntArray, IntArray]:
    """Row and column of the cells of points (N, 2), of the nearest cell where one is outside."""
    index = np.floor((points - grid.origin) / grid.resolution).astype(np.int64)
    last = np.array(grid.shape) - 1
    return np.clip(index[:, 1], 0, last[0]), np.clip(index[:, 0], 0, last[1])


class ManipulationTask(Task):
    """Boxes that have to go somewhere. Subclasses say where, and what that is worth."""

    goal_kind = "objects"
    actions: ClassVar[tuple[str, ...]] = ("heading", "waypoint", "velocity", "wheels")
    observations: ClassVar[tuple[str, ...]] = ("image", "spatial", "state")
    idle_limits: ClassVar[Mapping[str, int]]
    """Actions without progress after which an episode is cut off, by action mode. The others
    are cut off after as much simulated time as that many heading actions take to drive."""

    end: ClassVar[str]
    """The reason for which a successful episode ends."""
    towards: ClassVar[float] = 1.0
    """Weight of a metre towards the goal, relative to a metre away from it."""
    done_reward: float = 10.0
    back_reward: ClassVar[float] = 0.0
    """For each box that was done and is no longer."""
    end_reward: ClassVar[float] = 0.0

    goal: AreaGoal
    variations: ManipulationVariations

    def _prepare(self) -> None:
        dimensions = self.preset
        wanted = self.variations
        robot = self._make_robot()
        self.heading_step = dimensions.heading_step
        self.waypoint_window = dimensions.windows[wanted.layout]
        step_time = self.slowness * self.heading_step / robot.max_speed
        self.idle_time = self.idle_limits["heading"] * step_time
        self.box_size = wanted.box_size or dimensions.box_size
        least = LEAST_SIZE * dimensions.box_size
        if self.box_size < least:
            raise ScenarioError(
                f"{self.name}: box_size must be at least {least:g} m in this preset, "
                f"got {self.box_size:g}"
            )
        self.box_count = wanted.boxes or dimensions.boxes[wanted.layout]
        self.state_objects = max(self.state_objects, self.box_count)
        self._field: GeodesicField | None = None
        self._idle_actions = 0
        self._idle_since = 0.0
        self._furnish_room()

    @abstractmethod
    def _furnish_room(self) -> None:
        """Set `goal`, `reach` and whatever is the same in every start."""

    @property
    def field(self) -> GeodesicField:
        """Distance of a point to the goal around what is static [m], in this episode."""
        if self._field is None:
            raise InvalidInputError(f"{self.name}: start() has to be called first")
        return self._field

    def start(self, rng: np.random.Generator) -> World:
        """A new start: what is static, the robot, then boxes that it can get to."""
        for left in reversed(range(_LAYOUT_TRIES)):
            static, random = self._layout(rng)
            try:
                world = self._furnish(rng, static)
                break
            except ScenarioError:  # another draw of what is static may leave more room
                if not random or not left:
                    raise
        resolution = self.preset.field_resolution
        field = geodesic_field(static, self.goal, resolution=resolution)
        self._field = field
        self._farthest = float(field.values[np.isfinite(field.values)].max())
        self._idle_actions = 0
        self._idle_since = world.time
        self._start = world.movables
        self._seen = (world, *self._measure(world))
        return world

    @abstractmethod
    def _layout(self, rng: np.random.Generator) -> tuple[StaticMap, bool]:
        """Return the static map, and whether another call may return a different one."""

    @abstractmethod
    def _robot_poses(self, rng: np.random.Generator, static: StaticMap) -> FloatArray:
        """(N, 3) candidates for the robot's start, best first."""

    @abstractmethod
    def _box_region(self) -> tuple[FloatArray, list[Any]]:
        """(4,) where centres of boxes may be [m], and Shapely geometries that they stay off."""

    def _furnish(self, rng: np.random.Generator, static: StaticMap) -> World:
        """Robot and boxes among static obstacles; every box within the robot's reach."""
        size = self.box_size
        preset = self.preset
        free_space = FreeSpace(static)
        radius = self.robot.circumscribed_radius
        resolution = self.preset.field_resolution
        middle = self.goal.polygon.mean(axis=0)
        reach = Reach.around(static, middle, radius, resolution)
        extent = 0.5 * float(np.ptp(self.goal.polygon, axis=0).max())
        candidates = self._robot_poses(rng, static)
        if not reach.within(middle[None], radius + extent).all():
            candidates = candidates[:0]
        pose = self._free_pose(candidates, free_space, reach)
        region, keep_off = self._box_region()
        boxes = place_boxes(
            free_space,
            rng,
            self.box_count,
            size,
            footprint_at(self.robot, pose),
            preset=preset,
            wanted=self.variations,
            keep_off=[(shape, 0.0) for shape in keep_off],
            spacing=preset.box_spacing / preset.box_size * size,
            within=region,
            allowed=lambda centres: reach.within(centres, radius + 0.5 * size),
        )
        return World(
            robot=self.robot,
            robot_pose=pose,
            static=static,
            movables=boxes,
            goal=self.goal,
        )

    def _free_pose(self, candidates: FloatArray, free_space: FreeSpace, reach: Reach) -> FloatArray:
        """The first pose that overlaps nothing and from which the robot gets around."""
        near = reach.within(candidates[:, :2], self.robot.circumscribed_radius)
        for candidate in candidates[near]:
            pose: FloatArray = candidate
            parts = np.array(footprint_at(self.robot, pose))
            if free_space.is_free(parts, GAP * self.box_size).all():
                return pose
        raise ScenarioError(
            f"{self.name}: there is no free start for robot {self.robot.name!r} in layout "
            f"{self.variations.layout!r} from which it can get to the goal"
        )

    @abstractmethod
    def _measure(self, world: World) -> tuple[FloatArray, BoolArray]:
        """(K,) goal distance [m] of each box of the start, and whether it is done."""

    def _state(self, world: World) -> tuple[FloatArray, BoolArray]:
        """`_measure`, kept for the world that the last step ended in."""
        if self._seen[0] is not world:
            self._seen = (world, *self._measure(world))
        return self._seen[1:]

    def score(
        self, before: World, after: World, *, work: float, touched_static: bool
    ) -> StepOutcome:
        """The reward of the task; over when every box is done."""
        if self._field is None:
            raise InvalidInputError(f"{self.name}: start() has to be called before score()")
        far, was_done = self._state(before)
        near, done = self._state(after)
        closer = far - near
        gained = int((done & ~was_done).sum())
        progress = float((closer * np.where(closer > 0.0, self.towards, 1.0)).sum())
        reward = self.preset.progress_reward * progress + self.done_reward * gained
        reward += self.back_reward * int((was_done & ~done).sum())
        if touched_static:
            reward += STATIC_REWARD
        if self._is_still(before, after):
            reward += STILL_REWARD
        idle = self._idle(after, gained > 0)
        if done.all():
            return StepOutcome(reward + self.end_reward, True, self.end, True, False, done)
        return StepOutcome(reward, False, "no_progress" if idle else "", False, idle, done)

    def _is_still(self, before: World, after: World) -> bool:
        """True if the robot has not moved although it should."""
        return False

    def goal_distances(self, poses: FloatArray) -> FloatArray:
        """(K,) shortest way of each box centre to the goal [m], from poses (K, 3)."""
        found = self.field.sample_each(poses[:, :2])
        return np.where(np.isinf(found), self._farthest, found)

    def _idle(self, world: World, progress: bool) -> bool:
        """Count a step that ended in ``world``; return True after too long without progress."""
        self._idle_actions += 1
        if progress:
            self._idle_actions = 0
            self._idle_since = world.time
        limit = self.variations.idle_limit
        if limit is None and self.action in self.idle_limits:
            return self._idle_actions >= self.idle_limits[self.action]
        limit = self.idle_time if limit is None else limit
        return bool(world.time - self._idle_since >= limit * (1.0 - 1e-9))

    def _image(self, name: str) -> ImageObservation:
        """``"image"``, or ``"spatial"``, the same at fewer pixels."""
        window = self.waypoint_window
        pixels = _PIXELS[name]
        return ImageObservation(_CHANNELS, (window, window), (pixels, pixels))
