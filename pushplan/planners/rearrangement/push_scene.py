"""`PushScene`: a snapshot with all that candidate pushes and their costs are computed from."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from pushplan.core import interaction
from pushplan.core import rearrangement as core
from pushplan.interaction import QuasiStatic
from pushplan.interaction.quasi_static import Settings
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.planners.arguments import check_pusher
from pushplan.planners.rearrangement.object_paths import (
    ObjectPaths,
    PushCostToGo,
    make_object_goal,
    object_paths,
    push_cost_to_go,
)
from pushplan.planners.rearrangement.push_starts import PushStarts
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.planners.rearrangement.search_budget import SearchBudget
from pushplan.world import Movables, PushplanError, RobotModel, StaticMap, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray

T = TypeVar("T")

# Lengths are in circumscribed radii of the robot.
_GOAL_SLACK = 0.012
"""By how much an object has to be clear of its goal's edge."""
_COARSE_CELL = 0.3
"""Side of a cell of the lattice for approaches between pushes."""
_CELL = 0.2
"""The same of the lattice for the next approach."""
_STEP = 0.08
"""Distance between two commands of a predicted push."""
_MOST_STEPS = 5000
"""Greatest number of commands in a predicted push."""
_CONTACT_STEP = 0.25
_CONTACT_ROUNDS = 10
"""Of `QuasiStatic`: coarser than its defaults, as hundreds of pushes are simulated in a plan."""
_CURVATURE = 1.5
"""Of the robot's path where it steers most [1 / circumscribed radius]."""
_ARM = 0.8
"""Distance by which a turn of one radian carries an object along."""
_SLACK = 0.05
"""Clearance between the bumper and the object where a push begins."""
_TURN_DISTANCE = 0.2
"""Distance that a turn of an object by one radian is as good as."""
_FOREMOST = 0.9
"""Part of the bumper's distance ahead beyond which a corner belongs to the bumper."""
MARGIN = 0.03
"""Distance that approaches keep from what is static."""
_LEAST_MARGIN = 0.3 * MARGIN
"""Distance from what is static that the robot keeps wherever it is placed."""
_POSE_S = 6e-7
"""Time that a pose of the lattice takes [s]."""
_TURN_COST = 0.03
"""Cost of a turn by one radian on the spot, so that needless ones are left out."""
_LEAST_CELL = 0.012
"""Side of a cell that is not too small for the map, as a fraction of its longer side."""


def pose_distance(pose: FloatArray, other: FloatArray, size: float) -> float:
    """Return the distance between two poses (3,) of an object, turns included, in ``size``."""
    turn = math.remainder(float(pose[2] - other[2]), math.tau)
    return math.dist(pose[:2], other[:2]) / size + _TURN_DISTANCE * abs(turn)


@dataclass(frozen=True, eq=False)
class PushScene:
    """A world, and what the core needs to know of it.

    Args:
        world: the snapshot; its goal is one for the objects.
        config: settings.
        cache: what is known from the last scene.
        budget: of the decision that is made for it; endless by default.
        delivered: ids of objects that were done before; with noise they are so until they are
            surely not.
    """

    world: World
    config: RearrangementConfig
    cache: RolloutCache | None = None
    budget: SearchBudget = field(default_factory=SearchBudget)
    delivered: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        check_pusher(self.world)

    def _changed(self, **values: Any) -> PushScene:
        """The same with other fields, or with other values of what is worked out from them."""
        other = object.__new__(PushScene)
        other.__dict__.update({**self.__dict__, **values})
        other.__dict__.pop("progress", None)
        return other

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what a copy works out by itself."""
        if self.budget.interrupted:
            raise PushplanError(
                "a policy cannot be copied while it searches for its next push: copy it when it "
                "has begun that push, or before reset()"
            )
        given = {one.name: getattr(self, one.name) for one in fields(self)}
        return {**given, "budget": SearchBudget(), "poses": self.poses}

    @cached_property
    def progress(self) -> dict[Hashable, Any]:
        """Results of decisions for this scene; one that was interrupted is gone on with."""
        return {}

    def known(self, key: Hashable, make: Callable[[], T]) -> T:
        """The result of `make`, made once for the scene."""
        if key not in self.progress:
            self.progress[key] = make()
        found: T = self.progress[key]
        return found

    @property
    def finer_lattice_s(self) -> float:
        """Time that it takes to make that lattice and to search it, roughly [s]."""
        if "finer" in self.progress:
            return 0.0
        return _POSE_S * 4.0 * self.fine.grid.blocked.size

    def on_finer_lattice(self) -> PushScene:
        """The same with approaches on half the cells, that keep little distance from walls."""
        return self._changed(fine=self._lattice(_CELL, _LEAST_MARGIN, part=0.5))

    def with_objects_at(self, poses: FloatArray, cache: RolloutCache | None = None) -> PushScene:
        """The same with the objects at poses (K, 3), as far as rolling out pushes goes.

        The world, and with it where the robot is, stays as it is.
        """
        moved = self._changed(poses=np.ascontiguousarray(poses), cache=cache)
        for name in ("done", "remaining_now", "fine", "coarse", "starts"):
            moved.__dict__.pop(name, None)
        return moved

    @property
    def size(self) -> float:
        """Circumscribed radius of the robot [m]."""
        return self.world.robot.circumscribed_radius

    @property
    def movables(self) -> Movables:
        """The objects."""
        return self.world.movables

    @property
    def robot_cell(self) -> bytes:
        """About where the robot is."""
        return np.round(self.world.robot_pose[:2] / (2.0 * self.size)).tobytes()

    @cached_property
    def half(self) -> float:
        """Half the width of the bumper, the robot's foremost edge [m]."""
        vertices = self.world.robot.vertices
        return float(np.abs(vertices[vertices[:, 0] > _FOREMOST * self.front, 1]).max())

    @cached_property
    def front(self) -> float:
        """Distance of the bumper ahead of the robot's origin [m]."""
        return float(self.world.robot.vertices[:, 0].max())

    @cached_property
    def poses(self) -> FloatArray:
        """(K, 3) poses of the objects."""
        return np.ascontiguousarray(self.movables.poses)

    @cached_property
    def _contacts(self) -> tuple[interaction.Bodies, Settings]:
        config = self.config
        model = QuasiStatic(
            config.friction,
            config.gyration_scale,
            step=_CONTACT_STEP,
            iterations=_CONTACT_ROUNDS,
            static_friction=config.static_friction,
        )
        return model.bodies(self.world), model.settings(self.world)

    @property
    def bodies(self) -> interaction.Bodies:
        """Robot, objects and walls as the core reads them."""
        return self._contacts[0]

    @property
    def settings(self) -> Settings:
        """Numerical settings of the contact model."""
        return self._contacts[1]

    def contacts(self) -> interaction.QuasiStatic:
        """The contact model, with memory for one caller."""
        return interaction.QuasiStatic(self.bodies, *self.settings)

    @cached_property
    def is_jammed(self) -> bool:
        """True if the robot stands in something static, as far as is known: it has to get out."""
        path = np.stack([self.world.robot_pose] * 2)
        out = np.empty((2, len(self.poses), 3))
        return self.contacts().sweep(path, self.poses.copy(), out) >= 0

    def are_done(self, poses: FloatArray) -> BoolArray:
        """(K,) whether objects at poses (K, 3) are where they belong."""
        done: BoolArray = core.all_done(poses, self.bodies, self.object_goal)
        if self.config.position_noise > 0.0 and len(self.delivered):
            stays = core.all_done(poses, self.bodies, self._goal_with(0.0))
            done |= stays & np.isin(self.movables.ids, self.delivered)
        return done

    @cached_property
    def object_goal(self) -> core.ObjectGoal:
        """When objects are done."""
        return self._goal_with(2.0 * self.config.position_noise)

    def _goal_with(self, noise: float) -> core.ObjectGoal:
        """When objects are done that have to be farther from the goal's edge by a noise [m]."""
        slack = _GOAL_SLACK * self.size + noise
        return make_object_goal(self.world.goal, self.world.static, slack)

    @cached_property
    def controller(self) -> core.PushingController:
        """Parameters of the pushing controller for this robot."""
        step = _STEP * self.size
        return core.PushingController(
            step=step,
            turn=_CURVATURE * step / self.size,
            size=self.size,
            half=self.half,
            front=self.front,
            ahead=0.5 * self.size,
            gain=1.5,
        )

    @cached_property
    def done(self) -> BoolArray:
        """(K,) whether each object is where it belongs."""
        return self.are_done(self.poses)

    @property
    def turn_cost(self) -> float:
        """Cost of a turn on the spot [m/rad]."""
        return _TURN_COST * self.size

    @property
    def arm(self) -> float:
        """Distance by which a turn carries an object along [m/rad]."""
        return _ARM * self.size

    @cached_property
    def weights(self) -> FloatArray:
        """(K,) metres of the robot's path that a metre of each object's path is worth."""
        world = self.world
        return self.config.work_weight * world.movables.masses / world.robot.mass

    @cached_property
    def contact_weights(self) -> FloatArray:
        """(K,) cost of carrying each object a metre along on an approach.

        However light it is, it will not be where it was expected.
        """
        return np.maximum(self.weights, self.config.contact_cost)

    @cached_property
    def fine(self) -> ContactGrid:
        """The lattice on which the next approach is planned."""
        return self._lattice(_CELL, MARGIN)

    @cached_property
    def coarse(self) -> ContactGrid:
        """The lattice on which the cost of approaches between pushes is computed."""
        return self._lattice(_COARSE_CELL, MARGIN)

    def _lattice(self, cell: float, margin: float, part: float = 1.0) -> ContactGrid:
        world = self.world
        return contact_grid(world.robot, world.static, cell, margin, self.poses, self.bodies, part)

    def route_search(self, weights: FloatArray) -> core.RouteSearch:
        """The costs of legs and turns on the way to a push.

        Args:
            weights: (K,) cost of carrying each object a metre along.
        """
        robot = self.world.robot
        margin = MARGIN * self.size
        return core.RouteSearch(
            step=0.1 * self.size,
            turn_cost=self.turn_cost,
            arm=self.arm,
            shape=footprint(robot, margin),
            tight=footprint(robot, 0.5 * margin),
            among=obstacles(keep_out(self.world)),
            poses=self.poses,
            bodies=self.bodies,
            weights=weights,
        )

    @cached_property
    def longest(self) -> float:
        """Greatest length of a predicted push [m]."""
        sides = self.world.static.bounds[2:] - self.world.static.bounds[:2]
        return min(2.0 * float(sides.sum()), _MOST_STEPS * self.controller.step)

    @property
    def left(self) -> list[int]:
        """Indices of the objects that are not done."""
        found: list[int] = np.flatnonzero(~self.done).tolist()
        return found

    @cached_property
    def remaining_now(self) -> FloatArray:
        """(K,) shortest path of each object's middle to the goal [m]."""
        return self.object_paths.remaining(self.poses)

    @cached_property
    def starts(self) -> PushStarts:
        """Poses from which the robot can push the objects."""
        return PushStarts(
            self.world.robot,
            self.world.static,
            self.movables,
            self.poses,
            reach=self.front + _SLACK * self.size,
            margin=_LEAST_MARGIN * self.size,
        )

    @cached_property
    def object_paths(self) -> ObjectPaths:
        """Shortest paths of the objects to their goal."""
        return object_paths(self.world.static, self.world.goal)

    def push_cost_to_go(self, k: int) -> PushCostToGo:
        """Return the cost to push objects of the size of object ``k`` to their goal."""
        world = self.world
        return push_cost_to_go(
            world.robot,
            world.static,
            world.goal,
            radius=round(float(self.movables.radii[k]), 6),
            half_width=self.half,
            slack=_SLACK * self.size,
            margin=_LEAST_MARGIN * self.size,
        )


class ContactGrid(NamedTuple):
    """A lattice with the objects on it."""

    grid: core.PoseGrid
    layers: NDArray[np.float32]  # (K, 16, rows, columns) depth of the footprint in each object [m]


def contact_grid(
    robot: RobotModel,
    static: StaticMap,
    cell: float,
    margin: float,
    poses: FloatArray,
    bodies: interaction.Bodies,
    part: float = 1.0,
) -> ContactGrid:
    """The lattice for a robot among what is static and objects.

    Args:
        robot: its footprint.
        static: walls and columns.
        cell: side of a cell that is not too small for the map [circumscribed radii].
        margin: distance to keep from what is static [circumscribed radii].
        poses: (K, 3) of the objects.
        bodies: their shapes.
        part: of such a cell, for a finer lattice.
    """
    size = robot.circumscribed_radius
    away = margin * size
    sides = static.bounds[2:] - static.bounds[:2]
    side = max(cell, _LEAST_CELL * float(sides.max()) / size) * size
    grid = make_pose_grid(robot, static, part * side, away)
    return ContactGrid(grid, grid.contact_depths(footprint(robot, away), poses, bodies))


@functools.lru_cache(maxsize=8)
def make_pose_grid(
    robot: RobotModel, static: StaticMap, step: float, margin: float
) -> core.PoseGrid:
    """The lattice for a robot among what is static; kept for the maps used last.

    Args:
        robot: its footprint.
        static: walls and columns.
        step: side of a cell [m].
        margin: distance to keep from what is static [m].
    """
    x0, y0, x1, y1 = static.bounds.tolist()
    cols = int((x1 - x0) / step) + 1
    rows = int((y1 - y0) / step) + 1
    return core.PoseGrid(
        x0 + 0.5 * ((x1 - x0) - (cols - 1) * step),
        y0 + 0.5 * ((y1 - y0) - (rows - 1) * step),
        step,
        rows,
        cols,
        footprint(robot, margin),
        obstacles(static),
    )
