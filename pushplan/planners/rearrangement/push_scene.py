"""`PushScene`: a snapshot with all that candidate pushes and their costs are computed from."""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from pushplan.geometry import convex_penetration
from pushplan.interaction import QuasiStatic
from pushplan.interaction.kernels import Bodies, Settings
from pushplan.motion.collision import (
    ConvexObstacles,
    Footprint,
    footprint,
    is_free,
    obstacles,
)
from pushplan.motion.keep_out import keep_out
from pushplan.planners.arguments import check_pusher
from pushplan.planners.rearrangement.controller_kernels import PushingController, along_path
from pushplan.planners.rearrangement.goal_kernels import ObjectGoal, all_done
from pushplan.planners.rearrangement.object_paths import (
    ObjectPaths,
    PushCostToGo,
    object_paths,
    push_cost_to_go,
)
from pushplan.planners.rearrangement.pose_grid_kernels import (
    HEADINGS,
    Layers,
    PoseGrid,
    block_moves,
    block_poses,
    contact_depths,
)
from pushplan.planners.rearrangement.push_pose_kernels import pose_behind_outline
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.planners.rearrangement.route_kernels import RouteProblem
from pushplan.world import (
    ClearanceArea,
    Goal,
    Movables,
    Receptacle,
    RobotModel,
    StaticMap,
    Stop,
    World,
)
from pushplan.world.checks import BoolArray, FloatArray, frozen
from pushplan.world.outline import outward_normals, transform

# Lengths are in circumscribed radii of the robot.
_GOAL_SLACK = 0.012
"""By how much an object has to be clear of its goal's edge."""
_COARSE_CELL = 0.3
"""Side of a cell of the lattice for approaches between pushes."""
_CELL = 0.2
"""The same of the lattice for the next approach."""
_LEAST_CELL = 0.012
"""Side of a cell that is not too small for the map, as a fraction of its longer side."""
_STEP = 0.08
"""Distance between two commands of a predicted push."""
_MOST_STEPS = 5000
"""Greatest number of commands in a predicted push."""
_CURVATURE = 1.5
"""Of the robot's path where it steers most [1 / circumscribed radius]."""
_ARM = 0.8
"""Distance by which a turn of one radian carries an object along."""
_SLACK = 0.05
"""Clearance between the bumper and the object where a push begins."""
MARGIN = 0.03
"""Distance that approaches keep from what is static."""
_LEAST_MARGIN = 0.3 * MARGIN
"""Distance from what is static that the robot keeps wherever it is placed."""
_TURN_COST = 0.03
"""Cost of a turn by one radian on the spot, so that needless ones are left out."""
_HARDEST = 10
"""Budgets after which the search is over, which only searches for relocations come to."""


class SearchBudget:
    """Counts simulated pushes of one decision; ends the search between two of them.

    Args:
        stop: the stop rule; None for no end.
        most: after so many simulated pushes no further ones are looked for; after `_HARDEST` times
            as many the search is over.

    Attributes:
        used: simulated pushes so far.
        cost: of the best order so far [m]; infinite while there is none.
        interrupted: whether something was left out because of the budget.
    """

    def __init__(self, stop: Stop | None = None, most: float = math.inf) -> None:
        self._check = None if stop is None else stop.start()
        self._most = most
        self._over = False
        self.used = 0
        self.cost = math.inf
        self.interrupted = False

    @property
    def is_over(self) -> bool:
        """True if the search has to return."""
        stopped = self._check is not None and self._check(self.used, self.cost)
        if stopped or self.used >= _HARDEST * self._most:
            self._over = self.interrupted = True
        return self._over

    @property
    def is_used_up(self) -> bool:
        """True if the budget is used up, so that one of the known pushes has to be chosen."""
        if self.is_over or self.used >= self._most:
            self.interrupted = True
            return True
        return False


@functools.lru_cache(maxsize=8)
def make_pose_grid(robot: RobotModel, static: StaticMap, step: float, margin: float) -> PoseGrid:
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
    grid = PoseGrid(
        x0 + 0.5 * ((x1 - x0) - (cols - 1) * step),
        y0 + 0.5 * ((y1 - y0) - (rows - 1) * step),
        step,
        np.empty((len(HEADINGS), rows, cols), dtype=np.bool_),
        np.zeros((2, len(HEADINGS), rows, cols), dtype=np.bool_),
    )
    shape, among = _fit_of(robot, static, margin)
    block_poses(grid, shape, among)
    block_moves(grid, shape, among)
    return grid._replace(blocked=frozen(grid.blocked), blocked_moves=frozen(grid.blocked_moves))


@functools.lru_cache(maxsize=8)
def _fit_of(
    robot: RobotModel, static: StaticMap, margin: float
) -> tuple[Footprint, ConvexObstacles]:
    return footprint(robot, margin), obstacles(static)


@functools.lru_cache(maxsize=8)
def make_object_goal(goal: Goal, static: StaticMap, slack: float) -> ObjectGoal:
    """The goal for kernels. Sides of a receptacle that lie on the bounds do not count."""
    assert isinstance(goal, ClearanceArea | Receptacle)
    polygon = goal.polygon
    normals = outward_normals(polygon)
    offsets = (normals * polygon).sum(axis=1)
    corners = [[x, y] for x in static.bounds[::2] for y in static.bounds[1::2]]
    # the sides of a receptacle that stand at the walls
    inner = (np.array(corners) @ normals.T).max(axis=0) > offsets + 4.0 * slack
    edges = np.column_stack([normals, offsets])[inner]
    return ObjectGoal(
        polygon, frozen(np.ascontiguousarray(edges)), isinstance(goal, Receptacle), slack
    )


def heading_axes(heading: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) along a heading [rad] and to the left of it."""
    c = math.cos(heading)
    s = math.sin(heading)
    return np.array([c, s]), np.array([-s, c])


def initial_heading(path: FloatArray, ahead: float) -> float:
    """Heading [rad] from the start of a path to a point some distance along it [m]."""
    x, y, _, _ = along_path(path[0, 0], path[0, 1], path, 0.0, ahead)
    return math.atan2(y - path[0, 1], x - path[0, 0])


def pose_distance(pose: FloatArray, other: FloatArray, size: float) -> float:
    """Return the distance between two poses (3,) of an object, turns included, in ``size``."""
    turn = math.remainder(float(pose[2] - other[2]), math.tau)
    return math.dist(pose[:2], other[:2]) / size + 0.2 * abs(turn)


def open_edges(area: ClearanceArea) -> Iterator[tuple[FloatArray, FloatArray, FloatArray, float]]:
    """The edges that can be crossed: first corner, unit vectors along it and out, length [m]."""
    ends = zip(area.polygon, np.roll(area.polygon, -1, axis=0), area.open_edges, strict=True)
    for a, b, is_open in ends:
        if is_open:
            length = np.hypot(*(b - a))
            along = (b - a) / length
            yield a, along, np.array([along[1], -along[0]]), float(length)


class ContactGrid(NamedTuple):
    """A lattice with the objects on it."""

    grid: PoseGrid
    layers: Layers


@dataclass(frozen=True, eq=False)
class PushScene:
    """A world, and what the kernels need to know of it.

    Args:
        world: the snapshot; its goal is one for the objects.
        config: settings.
        cache: what is known from the last scene.
        budget: of the decision that is made for it; endless by default.
    """

    world: World
    config: RearrangementConfig
    cache: RolloutCache | None = None
    budget: SearchBudget = field(default_factory=SearchBudget)

    def __post_init__(self) -> None:
        check_pusher(self.world)

    def changed(self, **values: Any) -> PushScene:
        """The same with other fields, or with other values of what is worked out from them."""
        other = copy.copy(self)
        other.__dict__.update(values)
        return other

    def on_finer_lattice(self) -> PushScene:
        """The same with approaches on half the cells, that keep little distance from walls."""
        return self.changed(fine=self._contact_grid(_CELL, _LEAST_MARGIN, 0.5))

    def with_objects_at(self, poses: FloatArray) -> PushScene:
        """The same with the objects at poses (K, 3), as far as rolling out pushes goes.

        The world, and with it where the robot is, stays as it is.
        """
        moved = self.changed(poses=np.ascontiguousarray(poses), cache=None)
        for name in ("done", "remaining_now", "fine", "coarse", "route_problem"):
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
        return float(np.abs(vertices[vertices[:, 0] > 0.9 * self.front, 1]).max())

    @cached_property
    def front(self) -> float:
        """Distance of the bumper ahead of the robot's origin [m]."""
        return float(self.world.robot.vertices[:, 0].max())

    @cached_property
    def poses(self) -> FloatArray:
        """(K, 3) poses of the objects; a copy that kernels may read."""
        return np.ascontiguousarray(self.movables.poses)

    @cached_property
    def _model(self) -> QuasiStatic:
        return QuasiStatic(
            self.config.friction,
            step=0.25,
            iterations=10,
            static_friction=self.config.static_friction,
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
    def object_goal(self) -> ObjectGoal:
        """When objects are done."""
        slack = _GOAL_SLACK * self.size + 2.0 * self.config.position_noise
        return make_object_goal(self.world.goal, self.world.static, slack)

    @cached_property
    def controller(self) -> PushingController:
        """Parameters of the pushing controller for this robot."""
        step = _STEP * self.size
        return PushingController(
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
        return all_done(np.array(self.poses), self.bodies, self.object_goal)

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
        return self._contact_grid(_CELL, MARGIN)

    @cached_property
    def coarse(self) -> ContactGrid:
        """The lattice on which the cost of approaches between pushes is computed."""
        return self._contact_grid(_COARSE_CELL, MARGIN)

    def _contact_grid(self, cell: float, margin: float, part: float = 1.0) -> ContactGrid:
        """A lattice of a part of a cell that is not too small for the map."""
        robot = self.world.robot
        static = self.world.static
        away = margin * self.size
        sides = static.bounds[2:] - static.bounds[:2]
        side = max(cell, _LEAST_CELL * float(sides.max()) / self.size) * self.size
        grid = make_pose_grid(robot, static, part * side, away)
        shape, _ = _fit_of(robot, static, away)
        return ContactGrid(grid, contact_depths(grid, shape, self.poses, self.bodies))

    @cached_property
    def route_problem(self) -> RouteProblem:
        """The costs of legs and turns on the way to a push."""
        robot = self.world.robot
        margin = MARGIN * self.size
        return RouteProblem(
            step=0.1 * self.size,
            turn_cost=self.turn_cost,
            arm=self.arm,
            shape=footprint(robot, margin),
            tight=footprint(robot, 0.5 * margin),
            among=obstacles(keep_out(self.world)),
            poses=self.poses,
            bodies=self.bodies,
            weights=self.contact_weights,
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

    def index_of(self, number: int) -> int:
        """The index of the object with an id."""
        return int(np.flatnonzero(self.movables.ids == number)[0])

    def remaining(self, poses: FloatArray) -> FloatArray:
        """(K,) shortest path [m] of each object's middle to the goal from poses (K, 3)."""
        return np.array(
            [self.object_paths.length(x, y) if x < 1e6 else 0.0 for x, y, _ in poses.tolist()]
        )

    @cached_property
    def remaining_now(self) -> FloatArray:
        """(K,) `remaining` now."""
        return self.remaining(self.poses)

    @cached_property
    def object_paths(self) -> ObjectPaths:
        """Shortest paths of the objects to their goal."""
        return object_paths(self.world.static, self.world.goal)

    def object_path(self, k: int, clearance: float, deep: bool = False) -> FloatArray | None:
        """(M, 2) path of object ``k`` to where it is done, and on; None if there is none.

        Args:
            k: index of the object.
            clearance: distance that its middle keeps from what is static [m].
            deep: to the middle of a receptacle instead of its nearest place.
        """
        radius = float(self.movables.radii[k])
        return self.object_paths.path(self.poses[k, :2], radius, clearance, deep)

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

    def pose_behind(self, k: int, heading: float, shift: float) -> FloatArray:
        """(3,) a pose behind object ``k`` from which to push it along a heading.

        Args:
            k: index of the object.
            heading: [rad].
            shift: how far the robot's middle is to the left of the object [m].
        """
        outline = self.movables.outline(k)
        distance = self.front + _SLACK * self.size
        return pose_behind_outline(np.array(self.poses[k]), outline, heading, shift, distance)

    @cached_property
    def _fit(self) -> tuple[Footprint, ConvexObstacles]:
        return _fit_of(self.world.robot, self.world.static, _LEAST_MARGIN * self.size)

    def fits(self, pose: FloatArray) -> bool:
        """Return True if the robot fits at a pose (3,) among static obstacles."""
        shape, among = self._fit
        return bool(is_free(pose, shape, among, np.empty_like(shape.vertices)))

    def is_clear(self, pose: FloatArray) -> bool:
        """Return True if the robot at a pose (3,) overlaps no object."""
        movables = self.movables
        robot = self.world.robot
        away = np.hypot(*(self.poses[:, :2] - pose[:2]).T)
        for k in np.flatnonzero(away < self.size + movables.radii).tolist():
            outline = np.ascontiguousarray(movables.outline_world(k))
            for part in robot.contact_parts:
                body = np.ascontiguousarray(transform(pose, part))
                if convex_penetration(body, outline)[0] > 0.0:
                    return False
        return True
