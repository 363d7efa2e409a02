"""`ObjectPaths`: the shortest paths of objects to their goal on one map, worked out once."""

from __future__ import annotations

import functools
import math

import numpy as np

from pushplan.geometry import GoalDistances, goal_distances
from pushplan.motion.done_places import done_places
from pushplan.world import ClearanceArea, Goal, Receptacle, StaticMap
from pushplan.world.checks import FloatArray

_INSET = 1.05  # distance of an object from the edges of a receptacle when it is done [radii]
_MOST = 20_000  # how many lengths and paths are kept


class ObjectPaths:
    """Paths on one map to one goal for objects.

    Args:
        static: walls and columns.
        goal: the goal of the objects.
    """

    def __init__(self, static: StaticMap, goal: Goal) -> None:
        assert isinstance(goal, Receptacle | ClearanceArea)
        self._static, self._goal = static, goal
        self._plain = goal_distances(static, goal)
        self._lengths: dict[tuple[float, float], float] = {}
        self._paths: dict[object, FloatArray | None] = {}
        self._distances: dict[tuple[float, float, bool], GoalDistances | None] = {}

    def length(self, x: float, y: float) -> float:
        """Shortest path of a point to the goal [m]; inf if there is none."""
        length = self._lengths.get((x, y))
        if length is None:
            if len(self._lengths) >= _MOST:
                self._lengths.clear()
            length = self._lengths[x, y] = self._plain.path_from((x, y)).length
        return length

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
        key = (round(radius, 9), clearance, deep)
        asked = (*point.tolist(), *key)
        if asked not in self._paths:
            if len(self._paths) >= _MOST:
                self._paths.clear()
            self._paths[asked] = self._path(point, key)
        return self._paths[asked]

    def _path(self, point: FloatArray, key: tuple[float, float, bool]) -> FloatArray | None:
        if key not in self._distances:
            self._distances[key] = self._towards(*key)
        distances = self._distances[key]
        if distances is None:
            return None
        path = distances.path_from(point)
        if not math.isfinite(path.length):
            return None
        points = path.points
        if isinstance(self._goal, Receptacle):  # on to its far side, where it may be pushed
            middle, last = self._goal.polygon.mean(axis=0), points[-1]
            points = np.concatenate([points, (middle + 0.6 * (middle - last))[None]])
        steps = np.hypot(*np.diff(points, axis=0).T)
        points = points[np.concatenate([[True], steps > 1e-6 * key[0]])]
        return np.ascontiguousarray(points) if len(points) > 1 else None

    def _towards(self, radius: float, clearance: float, deep: bool) -> GoalDistances | None:
        goals = done_places(self._goal, radius, _INSET)
        if isinstance(self._goal, Receptacle) and (deep or goals is None):
            middle = self._goal.polygon.mean(axis=0)
            goals = [np.stack([middle, middle])]
        return None if goals is None else goal_distances(self._static, goals, clearance=clearance)


@functools.lru_cache(maxsize=8)
def object_paths(static: StaticMap, goal: Goal) -> ObjectPaths:
    """The paths on a map; kept for the maps used last."""
    return ObjectPaths(static, goal)
