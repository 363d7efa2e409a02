"""Shortest paths from one place to many."""

from __future__ import annotations

import math

import numpy as np

from pushplan.geometry import goal_distances
from pushplan.geometry.contours import free_points
from pushplan.geometry.shortest_path import leave_inflation
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray


class PathsFromStart:
    """As `pushplan.geometry.VisibilityGraph.shortest_path`, with the start looked up once.

    Args:
        static: what to go around.
        clearance: distance to keep from it [m]; a start that is nearer leaves straight first.
        start: (2,) where the paths begin [m].
    """

    def __init__(self, static: StaticMap, clearance: float, start: FloatArray) -> None:
        self._static, self._start = static, start
        self._begin = leave_inflation(static, clearance, start)
        if self._begin is not None:
            goal = [np.stack([self._begin, self._begin])]
            self._tree = goal_distances(static, goal, clearance=clearance)

    def to(self, place: FloatArray) -> FloatArray | None:
        """(N, 2) from the start to a place (2,) [m]; None if there is no path."""
        if self._begin is None:
            return None
        tree = self._tree
        if not free_points(place[None], tree.obstacles, self._static.bounds, tree.gap)[0]:
            return None
        path = tree.path_from(place)
        if not math.isfinite(path.length):
            return None
        points = path.points[::-1]
        if (self._begin != self._start).any():
            points = np.concatenate([self._start[None], points])
        return points
