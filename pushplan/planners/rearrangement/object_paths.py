"""Paths of objects to their goal on one map, worked out once, and that goal for the core."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from pushplan.core import rearrangement as core
from pushplan.geometry import GoalDistances, goal_distances
from pushplan.geometry.grid import nearest_marked
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.done_places import done_places
from pushplan.planners.rearrangement.rearrangement_config import SHIFTS
from pushplan.planners.rearrangement.search_budget import SearchBudget
from pushplan.world import ClearanceArea, Goal, Receptacle, RobotModel, StaticMap
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.outline import outward_normals

_INSET = 1.05  # distance of an object from the edges of a receptacle when it is done [radii]
_MOST_KEPT = 20_000  # greatest number of lengths and paths that are kept
_CELL = 0.125  # side of a cell [circumscribed radii of the robot]
_MOST_CELLS = 160  # along the longer side of a map
_ROWS = 8  # of cells that are worked out at once
_BEYOND = 0.6  # how far beyond the middle of a receptacle a path goes [length up to it]
_HALF_DEPTH = 0.85  # from the outline to the middle of an object, roughly [radii]
_GOAL_CELLS = 0.75  # distance from where an object is done at which a cell counts as that [cells]
_DRAG_COST = 10.0
"""Cost of a metre of an object's path on which the robot does not fit behind it [m pushed]."""


class ObjectPaths:
    """Shortest paths on one map to one goal for objects.

    Args:
        static: walls and columns.
        goal: the goal of the objects.
    """

    def __init__(self, static: StaticMap, goal: Goal) -> None:
        assert isinstance(goal, Receptacle | ClearanceArea)
        plain = goal_distances(static, goal)
        self.length = functools.lru_cache(_MOST_KEPT)(lambda x, y: plain.path_from((x, y)).length)
        """Shortest path of a point (x, y) to the goal [m]; inf if there is none."""
        distances = functools.cache(functools.partial(_distances, static, goal))
        self._paths = functools.lru_cache(_MOST_KEPT)(functools.partial(_path, goal, distances))

    def path(
        self, point: FloatArray, radius: float, clearance: float, deep: bool = False
    ) -> FloatArray | None:
        """(M, 2) path of an object to where it is done, and on; None if there is none.

        Args:
            point: (2,) where its middle is [m].
            radius: of the object [m].
            clearance: distance that its middle keeps from what is static [m].
            deep: to the middle of a receptacle instead of its nearest place.
        """
        return self._paths(*point.tolist(), round(radius, 9), clearance, deep)

    def remaining(self, poses: FloatArray) -> FloatArray:
        """(K,) length of the shortest path from poses (K, 3) to the goal [m]; 0 once removed."""
        return np.array(
            [0.0 if x >= 0.5 * core.REMOVED else self.length(x, y) for x, y, _ in poses.tolist()]
        )


def _distances(
    static: StaticMap, goal: Goal, radius: float, clearance: float, deep: bool
) -> GoalDistances | None:
    places = done_places(goal, radius, _INSET)
    if isinstance(goal, Receptacle) and (deep or places is None):
        middle = goal.polygon.mean(axis=0)
        places = [np.stack([middle, middle])]
    if places is None:
        return None
    return goal_distances(static, places, clearance=clearance)


def _path(
    goal: Goal,
    distances: Callable[[float, float, bool], GoalDistances | None],
    x: float,
    y: float,
    radius: float,
    clearance: float,
    deep: bool,
) -> FloatArray | None:
    towards = distances(radius, clearance, deep)
    path = None if towards is None else towards.path_from((x, y))
    if path is None or not math.isfinite(path.length):
        return None
    points = path.points
    if isinstance(goal, Receptacle):  # on to its far side, where it may be pushed
        middle = goal.polygon.mean(axis=0)
        last = points[-1]
        points = np.concatenate([points, (middle + _BEYOND * (middle - last))[None]])
    steps = np.hypot(*np.diff(points, axis=0).T)
    points = points[np.concatenate([[True], steps > 1e-6 * radius])]
    return np.ascontiguousarray(points) if len(points) > 1 else None


@functools.lru_cache(maxsize=8)
def object_paths(static: StaticMap, goal: Goal) -> ObjectPaths:
    """The paths on a map; kept for the maps used last."""
    return ObjectPaths(static, goal)


class PushCostToGo:
    """Cost of the cheapest path of an object to its goal [m], by the place of its middle.

    The path leads from cell to cell in sixteen directions. A metre of it costs a metre where the
    robot fits behind the object among what is static, and more where the object has to be brought
    on in another way: out of corners and gaps, and away from walls. Other objects do not count.

    Args:
        robot: which pushes.
        static: walls and columns.
        goal: of the object.
        radius: of the object [m].
        half_width: of the bumper [m].
        slack: clearance between bumper and object [m].
        margin: that the robot keeps from what is static [m].
        drag_cost: cost of a metre where the robot does not fit [m].
    """

    def __init__(
        self,
        robot: RobotModel,
        static: StaticMap,
        goal: Goal,
        *,
        radius: float,
        half_width: float,
        slack: float,
        margin: float,
        drag_cost: float = _DRAG_COST,
    ) -> None:
        low = static.bounds[:2]
        high = static.bounds[2:]
        sides = high - low
        self._step = max(_CELL * robot.circumscribed_radius, float(sides.max()) / _MOST_CELLS)
        cols, rows = (int(side) for side in np.floor(sides / self._step) + 1)
        self._low = low + 0.5 * (sides - self._step * np.array([cols - 1, rows - 1]))
        x = self._low[0] + self._step * np.arange(cols)
        y = self._low[1] + self._step * np.arange(rows)
        walls = shapely.union_all([shapely.Polygon(part) for part in static.convex_parts])
        shapely.prepare(walls)
        goals = _goal_shapes(goal, radius)
        places = np.stack(np.meshgrid(x, y), axis=2)
        shape = footprint(robot, margin)
        among = obstacles(static)
        shifts = np.array(SHIFTS) * half_width
        distance = float(robot.vertices[:, 0].max()) + slack + _HALF_DEPTH * radius

        def pieces() -> Iterator[tuple[BoolArray, BoolArray, BoolArray]]:
            for begin in range(0, rows, _ROWS):
                some = places[begin : begin + _ROWS]
                middles = shapely.points(some)
                is_open = np.ones(some.shape[:2], dtype=np.bool_)
                if not walls.is_empty:
                    is_open = shapely.distance(walls, middles) > 0.5 * radius
                at_goal = is_open & (shapely.distance(goals, middles) <= _GOAL_CELLS * self._step)
                fits = core.pushable_moves(some, is_open, shifts, distance, shape, among)
                yield is_open, at_goal, fits

        self._pieces = pieces()
        self._made: list[tuple[BoolArray, BoolArray, BoolArray]] = []
        self._drag_cost = drag_cost

    def prepare(self, budget: SearchBudget) -> bool:
        """Work the costs out row by row; False if the budget has ended that, to be gone on with."""
        while not budget.is_over:
            piece = next(self._pieces, None)
            if piece is None:
                return self._costs is not None
            self._made.append(piece)
        return False

    @cached_property
    def _costs(self) -> FloatArray:
        """(rows, columns) [m]."""
        is_open, at_goal, fits = zip(*self._made, *self._pieces, strict=True)
        open_cells = np.concatenate(is_open)
        seeds = np.flatnonzero(np.concatenate(at_goal))
        costs = np.zeros(open_cells.shape)
        if len(seeds):
            pushable = np.concatenate(fits, axis=1)
            costs = core.push_costs(open_cells, pushable, seeds, self._step, self._drag_cost)
        away, i, j = nearest_marked(np.isfinite(costs))
        found: FloatArray = costs[i, j] + self._drag_cost * self._step * away
        return found

    def at(self, pose: FloatArray) -> float:
        """Cost from a pose (3,) of the object [m]."""
        return float(self.along(pose[None])[0])

    def along(self, poses: FloatArray) -> FloatArray:
        """(N,) cost from poses (N, 3) of the object [m]."""
        cells = (poses[:, :2] - self._low) / self._step
        low = np.floor(cells)
        last = np.array(self._costs.shape)[::-1] - 1  # beyond the map the nearest cells count
        j, i = np.clip(low, 0, last).astype(np.int64).T
        b, a = np.clip(low + 1, 0, last).astype(np.int64).T
        x, y = (cells - low).T
        costs: FloatArray = self._costs[i, j] * (1 - y) * (1 - x) + self._costs[i, b] * (1 - y) * x
        costs += self._costs[a, j] * y * (1 - x)
        costs += self._costs[a, b] * y * x
        return costs


def _goal_shapes(goal: Goal, radius: float) -> Any:
    """The area in which an object is done, as a prepared shape."""
    places = done_places(goal, radius, 1.0)
    if places is None:
        assert isinstance(goal, Receptacle)
        places = [goal.polygon.mean(axis=0)[None]]
    shapes = shapely.union_all([shapely.MultiPoint(place).convex_hull for place in places])
    shapely.prepare(shapes)
    return shapes


push_cost_to_go = functools.lru_cache(maxsize=16)(PushCostToGo)
"""`PushCostToGo`, kept for the maps used last."""


@functools.lru_cache(maxsize=8)
def make_object_goal(goal: Goal, static: StaticMap, slack: float) -> core.ObjectGoal:
    """The goal for the core. Sides of a receptacle that lie on the bounds do not count.

    Args:
        goal: of the objects.
        static: the map with its bounds.
        slack: by how much an object has to be clear of the polygon's edge [m].
    """
    assert isinstance(goal, ClearanceArea | Receptacle)
    polygon = goal.polygon
    normals = outward_normals(polygon)
    offsets = (normals * polygon).sum(axis=1)
    corners = [[x, y] for x in static.bounds[::2] for y in static.bounds[1::2]]
    # the sides of a receptacle that stand at the walls
    inner = (np.array(corners) @ normals.T).max(axis=0) > offsets + 4.0 * slack
    edges = np.column_stack([normals, offsets])[inner]
    return core.ObjectGoal(
        polygon, np.ascontiguousarray(edges), isinstance(goal, Receptacle), slack
    )
