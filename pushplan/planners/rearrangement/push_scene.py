"""`PushScene`: a snapshot with all that candidate pushes and their costs are computed from."""

from __future__ import annotations

import copy
import functools
import math
from dataclasses import dataclass, field
from functools import cached_property

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
from pushplan.planners.arguments import check_pusher
from pushplan.planners.rearrangement.controller_kernels import PushingController
from pushplan.planners.rearrangement.goal_kernels import ObjectGoal, all_done
from pushplan.planners.rearrangement.object_paths import ObjectPaths, object_paths
from pushplan.planners.rearrangement.pose_grid import make_pose_grid
from pushplan.planners.rearrangement.pose_grid_kernels import (
    Layers,
    PoseGrid,
    add_layers,
    contact_depths,
)
from pushplan.planners.rearrangement.push_cost_to_go import PushCostToGo, push_cost_to_go
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.planners.rearrangement.search_budget import SearchBudget
from pushplan.world import ClearanceArea, Goal, Receptacle, RobotModel, StaticMap, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray, frozen
from pushplan.world.outline import outward_normals

_GOAL_SLACK = 0.012
"""By how much an object has to be clear of its goal's edge [circumscribed radii]."""
_COARSE_CELL = 0.3
"""Side of a cell of the lattice for approaches between pushes [circumscribed radii]."""


@functools.lru_cache(maxsize=8)
def _fit_of(
    robot: RobotModel, static: StaticMap, margin: float
) -> tuple[Footprint, ConvexObstacles]:
    return footprint(robot, margin), obstacles(static)


def check_world(world: World) -> None:
    """Refuse what no push can be made for; see `check_pusher`."""
    check_pusher(world, "pushing objects")


@functools.lru_cache(maxsize=8)
def make_object_goal(goal: Goal, static: StaticMap, slack: float) -> ObjectGoal:
    """The goal for kernels. Sides of a receptacle that lie on the bounds do not count."""
    assert isinstance(goal, ClearanceArea | Receptacle)
    polygon = goal.polygon
    normals = outward_normals(polygon)
    offsets = (normals * polygon).sum(axis=1)
    low, high = static.bounds[:2], static.bounds[2:]
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    # the sides of a receptacle that stand at the walls
    inner = (corners @ normals.T).max(axis=0) > offsets + 4.0 * slack
    edges = np.column_stack([normals, offsets])[inner]
    return ObjectGoal(
        polygon, frozen(np.ascontiguousarray(edges)), isinstance(goal, Receptacle), slack
    )


@dataclass(frozen=True, eq=False)
class ContactGrid:
    """A lattice with the objects on it.

    Args:
        grid: the lattice.
        layers: (K, 16, rows, columns) depth in each object [m].
        weights: (K,) cost of carrying each object along.
        around_cost: what is added to that of an object that is not to be moved.
    """

    grid: PoseGrid
    layers: Layers
    weights: FloatArray
    around_cost: float

    def contacts(
        self, fraction: float = 1.0, without: IntArray | None = None, target: int = -1
    ) -> tuple[FloatArray, FloatArray]:
        """(16, rows, columns) depth in the objects [m] at each pose, and their weights.

        Args:
            fraction: factor on the weights.
            without: indices of objects that are not there any more.
            target: index of an object that is not to be moved; -1 if none.
        """
        weights = fraction * self.weights
        if without is not None:
            weights[without] = 0.0
        if target >= 0:
            weights[target] += self.around_cost
        return add_layers(self.layers, weights)


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
        check_world(self.world)

    def with_budget(self, budget: SearchBudget) -> PushScene:
        """The same for a decision with a stop rule."""
        other = copy.copy(self)
        other.__dict__["budget"] = budget
        return other

    def on_finer_lattice(self) -> PushScene:
        """The same with approaches on half the cells, that keep little distance from walls."""
        other = copy.copy(self)
        other.__dict__["fine"] = self._contact_grid(0.5 * self.fine.grid.step, self._least_margin)
        return other

    def with_objects_at(self, poses: FloatArray) -> PushScene:
        """The same with the objects at poses (K, 3), as far as rolling out pushes goes.

        The world, and with it where the robot is, stays as it is.
        """
        moved = copy.copy(self)
        for name in ("done", "remaining_now", "fine", "coarse"):
            moved.__dict__.pop(name, None)
        moved.__dict__.update(poses=np.ascontiguousarray(poses), cache=None)
        return moved

    @property
    def size(self) -> float:
        """Circumscribed radius of the robot [m]."""
        return self.world.robot.circumscribed_radius

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
    def object_goal(self) -> ObjectGoal:
        """When objects are done."""
        slack = _GOAL_SLACK * self.size + 2.0 * self.config.position_noise
        return make_object_goal(self.world.goal, self.world.static, slack)

    @cached_property
    def controller(self) -> PushingController:
        """Parameters of the pushing controller for this robot."""
        step = self.config.step * self.size
        return PushingController(
            step=step,
            turn=self.config.curvature * step / self.size,
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
        return self.config.turn_cost * self.size

    @property
    def arm(self) -> float:
        """How far a turn carries an object along [m/rad]."""
        return self.config.arm * self.size

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
        return self._contact_grid(self._step(self.config.cell), self.config.margin * self.size)

    @cached_property
    def coarse(self) -> ContactGrid:
        """The lattice on which the cost of approaches between pushes is computed."""
        step = self._step(_COARSE_CELL)
        return self._contact_grid(step, self.config.margin * self.size)

    def _step(self, cell: float) -> float:
        """Side of a cell that is not too small for the map [m]."""
        sides = self.world.static.bounds[2:] - self.world.static.bounds[:2]
        return max(cell, 0.012 * float(sides.max()) / self.size) * self.size

    @property
    def _least_margin(self) -> float:
        """Distance from what is static that the robot keeps wherever it is placed [m]."""
        return 0.3 * self.config.margin * self.size

    def _contact_grid(self, step: float, margin: float) -> ContactGrid:
        world = self.world
        grid = make_pose_grid(world.robot, world.static, step, margin)
        shape = footprint(world.robot, margin)
        layers = contact_depths(grid, shape, self.poses, self.bodies)
        return ContactGrid(grid, layers, self.contact_weights, self.config.around_cost)

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
        radius = float(self.world.movables.radii[k])
        return self.object_paths.path(self.poses[k, :2], radius, clearance, deep)

    def push_cost_to_go(self, radius: float) -> PushCostToGo:
        """What it costs to push objects of a radius [m] to their goal."""
        world, config = self.world, self.config
        return push_cost_to_go(
            world.robot,
            world.static,
            world.goal,
            radius=round(radius, 6),
            half_width=self.half,
            slack=config.slack * self.size,
            margin=self._least_margin,
            config=config.relocation,
        )

    @cached_property
    def fit(self) -> tuple[Footprint, ConvexObstacles, FloatArray]:
        """Footprint, obstacles and memory for `is_free`."""
        shape, among = _fit_of(self.world.robot, self.world.static, self._least_margin)
        return shape, among, np.empty_like(shape.vertices)

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
            for part in robot.contact_parts:
                body = np.ascontiguousarray(part @ np.array([[c, s], [-s, c]]) + pose[:2])
                if convex_penetration(body, outline)[0] > 0.0:
                    return False
        return True
