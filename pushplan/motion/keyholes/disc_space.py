"""The configuration space of a robot that drives as a disc, among objects that may move."""

from __future__ import annotations

import functools
from collections.abc import Callable
from functools import cached_property

import numpy as np

from pushplan.geometry import Grid, clearance_field
from pushplan.geometry.free_components import FreeComponents, object_clearance
from pushplan.motion.time_slicing import go_on, never
from pushplan.search.grid_dijkstra import grid_dijkstra
from pushplan.world import GoalDisc, GoalPose, Movables, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_KEPT = 200  # distances to objects that are kept
_NEAR_POSE = 0.75  # distance from a goal pose at which a cell counts as the goal [cells]


class DiscSpace:
    """A grid over a world, and how far each cell is from each object wherever that lies.

    Args:
        world: walls, objects and goal; where the objects are does not matter.
        radius: of the disc [m].
        cell: side of a cell [m].
        closed_cost: extra cost per metre of floor that objects close, of `DiscState.relaxed`.
        stopped: ends work here, and in each `DiscState`, with `Stopped`.
    """

    def __init__(
        self,
        world: World,
        radius: float,
        cell: float,
        closed_cost: float,
        stopped: Callable[[], bool] = never,
    ) -> None:
        self.world = world
        self.radius = radius
        self.cell = cell
        self.closed_cost = closed_cost
        self.stopped = stopped
        self.grid = Grid.cover(world.static.bounds, cell)
        x, y = np.meshgrid(self.grid.x, self.grid.y)
        goal = world.navigation_goal
        if isinstance(goal, GoalPose):  # smaller than a cell: plans drive on to its middle
            goal = GoalDisc(goal.center, _NEAR_POSE * cell)
        self.goal: BoolArray = goal.contains(np.stack([x, y], axis=-1))
        clearance_at = functools.partial(
            _clearance_at, world.movables, self.grid, self.radius + self.cell, stopped
        )
        self._clearance = functools.lru_cache(_KEPT)(clearance_at)

    @cached_property
    def static(self) -> FloatArray:
        """(rows, columns) distance of each cell to what is static [m]."""
        field = clearance_field(self.world.static, self.grid, self.stopped)
        go_on(self.stopped)
        return field

    def object_clearance(self, k: int, pose: FloatArray) -> FloatArray:
        """(rows, columns) distance of each cell to object ``k`` at a pose (3,) [m].

        Infinite where that is farther than the disc and a cell.
        """
        return self._clearance(k, *pose.tolist())

    def cell_of(self, point: FloatArray) -> tuple[int, int]:
        """Row and column of the cell of a point (2,), or of the nearest one."""
        row, col = self.grid.cell(float(point[0]), float(point[1]))
        rows, cols = self.grid.shape
        return min(max(row, 0), rows - 1), min(max(col, 0), cols - 1)

    def number_of(self, point: FloatArray) -> int:
        """The same cell, counted row by row."""
        row, col = self.cell_of(point)
        return row * self.grid.shape[1] + col

    def points(self, cells: IntArray) -> FloatArray:
        """(N, 2) middles of cells (N,), counted row by row [m]."""
        rows, cols = np.divmod(cells, self.grid.shape[1])
        return np.column_stack([self.grid.x[cols], self.grid.y[rows]])


def _clearance_at(
    movables: Movables,
    grid: Grid,
    reach: float,
    stopped: Callable[[], bool],
    k: int,
    *pose: float,
) -> FloatArray:
    field = object_clearance(movables, k, np.array(pose), grid, reach, stopped)
    go_on(stopped)  # half a field is not kept
    return field


class DiscState:
    """Free space of the disc with the objects at some poses, and the part that the robot reaches.

    Args:
        space: the space.
        poses: (K, 3) of the objects.

    Attributes:
        robot: (3,) pose of the robot, whose disc is free there; set before anything is asked that
            depends on it.
    """

    robot: FloatArray

    def __init__(self, space: DiscSpace, poses: FloatArray) -> None:
        self.space = space
        self.poses = poses
        self.clearance: FloatArray = space.static.copy()
        for k, pose in enumerate(poses):
            go_on(space.stopped)
            np.minimum(self.clearance, space.object_clearance(k, pose), out=self.clearance)
        go_on(space.stopped)
        self.free = FreeComponents.of(space.grid, self.clearance, space.radius)
        go_on(space.stopped)

    @cached_property
    def reached(self) -> BoolArray:
        """(rows, columns) which cells the robot gets to without touching anything."""
        label = self.free.at(self.robot)
        reached: BoolArray = (self.free.labels == label) & (label > 0)
        return reached

    @property
    def is_open(self) -> bool:
        """True if the robot gets to the goal without touching anything."""
        return bool((self.reached & self.space.goal).any())

    def is_free(self, point: FloatArray) -> bool:
        """Return True if the disc fits at a point (2,)."""
        return bool(self.clearance[self.space.cell_of(point)] > self.space.radius)

    def nearest_free(self, pose: FloatArray) -> FloatArray:
        """(3,) the pose nearest to one (3,) where the disc fits; that one where it fits nowhere."""
        free = np.flatnonzero(self.clearance.ravel() > self.space.radius)
        if not len(free) or self.is_free(pose):
            return pose
        points = self.space.points(free)
        nearest = points[int(np.argmin(np.hypot(*(points - pose[:2]).T)))]
        return np.array([*nearest, pose[2]])

    def gets_to(self, point: FloatArray) -> bool:
        """Return True if the robot gets to a point (2,) without touching anything."""
        return bool(self.reached[self.space.cell_of(point)])

    @cached_property
    def _costs(self) -> tuple[FloatArray, IntArray]:
        """Lengths of paths from the robot to all cells [m], and the cells before them."""
        weights = np.where(self.reached, 1.0, np.inf)
        return self._dijkstra(weights, np.zeros_like(self.reached))[:2]

    def _dijkstra(
        self, weights: FloatArray, goals: BoolArray
    ) -> tuple[FloatArray, IntArray, IntArray]:
        space = self.space
        go_on(space.stopped)
        start = np.array([space.number_of(self.robot)])
        found = grid_dijkstra(weights, start, goals, space.cell, space.stopped)
        go_on(space.stopped)
        return found

    def length_to(self, point: FloatArray) -> float:
        """Length of the path to a point (2,) [m], infinite where the robot does not get."""
        return float(self._costs[0][self.space.cell_of(point)])

    def path_to(self, point: FloatArray) -> FloatArray:
        """(N, 2) corners of a path from the robot to a point (2,) that it gets to [m]."""
        cells = self._chain(self._costs[1], self.space.number_of(point))
        return self._corners(cells, point)

    def path_to_goal(self) -> FloatArray:
        """(N, 2) corners of a path from the robot to the nearest part of the goal [m]."""
        costs = np.where(self.space.goal & self.reached, self._costs[0], np.inf)
        at = int(np.argmin(costs))
        cells = self._chain(self._costs[1], at)
        return self._corners(cells, self.space.points(cells[-1:])[0])

    @cached_property
    def relaxed(self) -> tuple[float, list[int]]:
        """The cheapest path to the goal that may lead through objects.

        Its cost [m], infinite where walls are in the way, and the objects on it in order.
        """
        space = self.space
        weights = np.where(self.clearance > space.radius, 1.0, 1.0 + space.closed_cost)
        weights[space.static <= space.radius] = np.inf
        costs, parents, order = self._dijkstra(weights, space.goal)
        last = int(order[-1])
        if not space.goal.flat[last]:
            return np.inf, []
        cells = self._chain(parents, last)
        near = np.full((len(self.poses) + 1, len(cells)), np.inf)
        for k, pose in enumerate(self.poses):
            near[k] = space.object_clearance(k, pose).flat[cells]
        met = near.argmin(axis=0)[near.min(axis=0) <= space.radius]
        return float(costs.flat[last]), list(dict.fromkeys(met.tolist()))

    @staticmethod
    def _chain(parents: IntArray, at: int) -> IntArray:
        """Cells that lead to one, counted row by row."""
        chain = []
        while at >= 0:
            chain.append(at)
            at = int(parents[at])
        return np.array(chain[::-1])

    def _corners(self, cells: IntArray, end: FloatArray) -> FloatArray:
        """The corners that are left of a path along cells where the disc can go straight."""
        points = self.space.points(cells)
        points[0] = self.robot[:2]
        points[-1] = end[:2]
        kept = [0]
        at = 0
        while at < len(points) - 1:
            ahead = len(points) - 1
            while ahead > at + 1 and not self._sees(points[at], points[ahead]):
                ahead -= max(1, (ahead - at) // 8)
            at = max(ahead, at + 1)
            kept.append(at)
        return points[kept]

    def _sees(self, a: FloatArray, b: FloatArray) -> bool:
        """Return True if the disc can go straight from a to b."""
        count = int(np.hypot(*(b - a)) / (0.5 * self.space.cell)) + 2
        line = a + (b - a) * np.linspace(0.0, 1.0, count)[:, None]
        grid = self.space.grid
        at = ((line - grid.origin) / grid.resolution).astype(np.int64)
        rows = np.clip(at[:, 1], 0, grid.shape[0] - 1)
        cols = np.clip(at[:, 0], 0, grid.shape[1] - 1)
        return bool((self.clearance[rows, cols] > self.space.radius).all())
