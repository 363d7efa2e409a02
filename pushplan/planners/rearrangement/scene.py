"""`Scene`: a snapshot with everything that candidate pushes are made and priced from."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.geometry import convex_penetration
from pushplan.interaction import QuasiStatic
from pushplan.interaction.kernels import Bodies, Settings
from pushplan.motion.collision import (
    Footprint,
    Obstacles,
    footprint,
    is_free,
    obstacles,
)
from pushplan.planners.arguments import check_pusher
from pushplan.planners.rearrangement.line_up import bumper_half
from pushplan.planners.rearrangement.object_paths import Ways, ways_of
from pushplan.planners.rearrangement.pose_grid import HEADINGS, Floor, floor_of
from pushplan.planners.rearrangement.pose_search import Layers, add_up, contact_depths
from pushplan.planners.rearrangement.rearrangement_config import SubTaskConfig
from pushplan.planners.rearrangement.rollout import Law, Task, all_done, task_of
from pushplan.planners.rearrangement.rollout_cache import Recall
from pushplan.world import (
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.checks import BoolArray, FloatArray, IntArray

STEP = 0.12
"""Longest step between two commands of a push [circumscribed radii]."""
LED = 5.0
"""What is added to the price of carrying along an object that is to be pushed afterwards."""


@functools.lru_cache(maxsize=8)
def _fit_of(
    robot: RobotModel, static: StaticMap, margin: float
) -> tuple[Footprint, Obstacles, FloatArray]:
    shape = footprint(robot, margin)
    return shape, obstacles(static), np.empty_like(shape.vertices)


def check_world(world: World) -> None:
    """Refuse what no push can be made for; see `check_pusher`."""
    check_pusher(world, "pushing objects")


@dataclass(frozen=True, eq=False)
class Ground:
    """A lattice with the objects on it.

    Args:
        floor: the lattice.
        layers: (K, 16, rows, columns) depth in each object [m].
        weights: (K,) price of carrying each object along.
    """

    floor: Floor
    layers: Layers
    weights: FloatArray

    def contacts(
        self, share: float = 1.0, without: IntArray | None = None, led: int = -1
    ) -> tuple[FloatArray, FloatArray]:
        """(16, rows, columns) depth in the objects [m] at each pose, and their weights.

        Args:
            share: factor on the weights.
            without: indices of objects that are not there any more.
            led: index of an object that is not to be moved; -1 if none.
        """
        weights = share * self.weights
        if without is not None:
            weights[without] = 0.0
        if led >= 0:
            weights[led] += LED
        return add_up(self.layers, weights)


@dataclass(frozen=True, eq=False)
class Scene:
    """A world, and what the kernels need to know of it.

    Args:
        world: the snapshot; its goal is one for the objects.
        config: settings.
        recall: what is known from the last scene.
    """

    world: World
    config: SubTaskConfig
    recall: Recall | None = None

    def __post_init__(self) -> None:
        check_world(self.world)

    @property
    def size(self) -> float:
        """Circumscribed radius of the robot [m]."""
        return self.world.robot.circumscribed_radius

    @cached_property
    def half(self) -> float:
        """Half the width of the bumper [m]."""
        return bumper_half(self.world.robot)

    @cached_property
    def front(self) -> float:
        """How far the bumper is ahead of the robot's origin [m]."""
        return float(self.world.robot.vertices[:, 0].max())

    @cached_property
    def poses(self) -> FloatArray:
        """(K, 3) poses of the objects; a copy that kernels may read."""
        return np.ascontiguousarray(self.world.movables.poses)

    @cached_property
    def _model(self) -> QuasiStatic:
        config = self.config
        return QuasiStatic(
            config.friction,
            config.gyration_scale,
            step=0.25,
            iterations=10,
            static_friction=config.static_friction,
        )

    @cached_property
    def bodies(self) -> Bodies:
        """Shapes for the interaction kernels."""
        return self._model.bodies(self.world)

    @cached_property
    def settings(self) -> Settings:
        """Numerical settings of the interaction kernels."""
        return self._model.settings(self.world)

    @cached_property
    def task(self) -> Task:
        """When objects are done."""
        return task_of(self.world.goal, self.world.static, 0.012 * self.size)

    @cached_property
    def law(self) -> Law:
        """Parameters of the pushing law for this robot."""
        robot, period = self.world.robot, self.config.period
        return Law(
            step=min(robot.max_speed * period, STEP * self.size),
            turn=robot.max_turn_rate * period,
            size=self.size,
            half=self.half,
            front=self.front,
            ahead=0.5 * self.size,
            gain=1.5,
        )

    @cached_property
    def done(self) -> BoolArray:
        """(K,) whether each object is where it belongs."""
        return all_done(self.poses, self.bodies, self.task)

    @cached_property
    def weights(self) -> FloatArray:
        """(K,) metres of the robot's path that a metre of each object's path is worth."""
        world = self.world
        return self.config.price * world.movables.masses / world.robot.mass

    @cached_property
    def nuisance(self) -> FloatArray:
        """(K,) price of carrying each object a metre along on an approach.

        However light it is, it will not be where it was expected.
        """
        return np.maximum(self.weights, self.config.nuisance)

    @cached_property
    def fine(self) -> Ground:
        """The lattice on which the next approach is planned."""
        return self._ground(self.config.cell)

    @cached_property
    def coarse(self) -> Ground:
        """The lattice on which approaches between pushes are priced."""
        return self._ground(self.config.coarse_cell)

    def _ground(self, cell: float) -> Ground:
        world, size, movables = self.world, self.size, self.world.movables
        sides = world.static.bounds[2:] - world.static.bounds[:2]
        step = max(cell, 0.012 * float(sides.max()) / size) * size
        floor = floor_of(world.robot, world.static, step, self.config.margin * size)
        layers = contact_depths(
            floor,
            HEADINGS,
            footprint(world.robot, self.config.margin * size),
            self.poses,
            movables.vertices,
            movables.offsets,
            movables.radii,
            np.ones(len(movables), dtype=np.bool_),
        )
        return Ground(floor, layers, self.nuisance)

    def remaining(self, poses: FloatArray) -> FloatArray:
        """(K,) shortest way [m] of each object's middle to the goal from poses (K, 3)."""
        return np.array([self.ways.length(x, y) if x < 1e6 else 0.0 for x, y, _ in poses.tolist()])

    @cached_property
    def remaining_now(self) -> FloatArray:
        """(K,) `remaining` now."""
        return self.remaining(self.poses)

    @cached_property
    def ways(self) -> Ways:
        """Of the objects to their goal."""
        return ways_of(self.world.static, self.world.goal)

    def box_path(
        self, k: int, clearance: float, deep: bool = False, pose: FloatArray | None = None
    ) -> FloatArray | None:
        """(M, 2) way of object ``k`` to where it is done, and on; None if there is none.

        Args:
            k: index of the object.
            clearance: distance that its middle keeps from what is static [m].
            deep: to the middle of a receptacle instead of its nearest place.
            pose: (3,) where it is instead of where it is now.
        """
        point = (self.poses[k] if pose is None else pose)[:2]
        return self.ways.path(point, float(self.world.movables.radii[k]), clearance, deep)

    @cached_property
    def fit(self) -> tuple[Footprint, Obstacles, FloatArray]:
        """Footprint, obstacles and memory for `is_free`."""
        margin = 0.3 * self.config.margin * self.size
        return _fit_of(self.world.robot, self.world.static, margin)

    def fits(self, pose: FloatArray) -> bool:
        """Whether the robot fits at a pose (3,) among what is static."""
        shape, among, scratch = self.fit
        return bool(is_free(pose, shape, among, scratch))

    def is_clear(self, pose: FloatArray) -> bool:
        """Whether the robot at a pose (3,) overlaps no object."""
        movables, robot = self.world.movables, self.world.robot
        c, s = math.cos(pose[2]), math.sin(pose[2])
        away = np.hypot(*(self.poses[:, :2] - pose[:2]).T)
        for k in np.flatnonzero(away < self.size + movables.radii).tolist():
            outline = np.ascontiguousarray(movables.outline_world(k))
            for part in robot.parts:
                body = np.ascontiguousarray(part @ np.array([[c, s], [-s, c]]) + pose[:2])
                if convex_penetration(body, outline)[0] > 0.0:
                    return False
        return True
