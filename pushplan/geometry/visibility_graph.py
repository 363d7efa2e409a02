"""`VisibilityGraph`: shortest paths for a disc, of which only what is needed is made."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.geometry.contours import (
    contours_of,
    gap_of,
    has_many_corners,
    prepare_contours,
    standoff_of,
)
from pushplan.geometry.obstacles import obstacles_of
from pushplan.geometry.regions import Target, as_target, outside_area, regions_of
from pushplan.geometry.shortest_path import Path, ends_on_rims, leave_inflation, with_way_out
from pushplan.world import Goal, StaticMap
from pushplan.world.checks import FloatArray, IntArray, array, expect, number

SOME_CORNERS = 400
"""Corners of obstacles from which on a search that takes long need not find the shortest path."""
_LONG_BUDGETS = 20  # of a search without estimates, after which it takes long
_PLAIN_BUDGETS = 5  # the same where there are many corners
_CELLS = 10_000  # of estimates between two looks at a stop rule: about a millisecond
_CELL = 0.6
"""Side of a cell of estimates [clearances]; larger ones look through more closed passages."""
_BUDGET = 20_000  # work of a search between two looks at a stop rule: about a millisecond


class VisibilityGraph:
    """Shortest paths for a disc-shaped robot among the obstacles of one map.

    Straight walls and polygons are exact; where a path bends around an arc (a thick segment's end,
    a corner at a clearance), that arc comes out at most 0.07 % too long, or 0.6 % where obstacles
    have more than 2,200 corners. Where they have more than 400, a search that takes long gives a
    path that is as a rule at most 5 % longer than the shortest, unless ``exact`` is set. Paths stay
    inside ``static.bounds`` and may touch obstacles; obstacles that touch each other leave no
    passage. Only what a path may need of the graph is made. `goal_distances` makes all of it, and
    pays where many paths lead to one goal.

    Args:
        static: obstacles and bounds.
        clearance: distance that paths keep from obstacles [m], such as the robot's radius.
        exact: find the shortest path, however long that takes: seconds in an office.

    Raises:
        InvalidInputError: if the clearance is negative.
    """

    def __init__(self, static: StaticMap, clearance: float = 0.0, *, exact: bool = False) -> None:
        self.static = expect("static", static, StaticMap)
        self.clearance = number("clearance", clearance, low=0.0)
        self.exact = expect("exact", exact, bool)

    def shortest_path(self, start: ArrayLike, goal: ArrayLike) -> Path:
        """The shortest path between two points (2,) [m].

        From a start that is too close to an obstacle but not inside, the path first leaves by the
        shortest way. A goal that is too close to an obstacle cannot be reached.
        """
        end: FloatArray = array("goal", goal, (2,))
        return self.to_goal(start, [np.stack([end, end])])

    def to_goal(
        self,
        start: ArrayLike,
        goal: Goal | Sequence[ArrayLike],
        stopped: Callable[[], bool] = lambda: False,
    ) -> Path:
        """The shortest path from a point (2,) [m] to the nearest point that counts as the goal.

        There is none either where ``stopped``, which is asked about every millisecond, ends the
        search.
        """
        origin: FloatArray = array("start", start, (2,))
        target = as_target(goal)
        if outside_area(target, origin):
            return Path(0.0, origin[None])
        if not prepare_contours(self.static, self.clearance, stopped):
            return Path(math.inf)
        free = leave_inflation(self.static, self.clearance, origin)
        if free is None or stopped():
            return Path(math.inf)
        return self._search(origin, free, target, stopped)

    def _search(
        self, origin: FloatArray, free: FloatArray, target: Target, stopped: Callable[[], bool]
    ) -> Path:
        static = self.static
        clearance = self.clearance
        gap = gap_of(static)
        regions = regions_of(target)
        around = obstacles_of(static, clearance)
        scene = core.GoalScene(regions, around, static.bounds, gap)
        contours = contours_of(static, clearance)
        points = np.concatenate([contours.corners, ends_on_rims(static, clearance, regions)])
        corners = core.Corners(
            points,
            contours.incoming,
            contours.outgoing,
            contours.owner,
            *_boxes_of(static, clearance),
        )
        grid = _obstacle_grid(static, clearance)
        sliver = standoff_of(static, clearance)
        search = core.VisibilitySearch(free, corners, scene, grid, sliver)
        outcome = core.SearchOutcome.PAUSED
        budgets = 0
        patience = _LONG_BUDGETS
        if has_many_corners(around):
            patience = _PLAIN_BUDGETS
        while outcome == core.SearchOutcome.PAUSED:
            if stopped():
                return Path(math.inf)
            if budgets == patience and not self.exact and len(around.vertices) > SOME_CORNERS:
                sides = _covered_sides(static, clearance)
                estimate = core.GoalEstimate(sides, scene, free)
                while not estimate.run(_CELLS):
                    if stopped():
                        return Path(math.inf)
                search = core.VisibilitySearch(free, corners, scene, grid, sliver, estimate)
            outcome = search.run(_BUDGET)
            budgets += 1
        if outcome == core.SearchOutcome.EXHAUSTED:
            return Path(math.inf)
        nodes = search.path()
        path = [free, *points[nodes]]
        length = 0.0
        exits = []
        if len(nodes) == 0 or nodes[-1] < len(contours.corners):  # it goes on into the goal
            length, x, y = scene.goal_leg(*path[-1].tolist())
            if length > 0.0:
                exits.append(np.array([x, y]))
        for there, here in pairwise(path[::-1]):
            length += math.hypot(*(there - here))
        return with_way_out(origin, free, gap, (length, path + exits))


@lru_cache(maxsize=32)
def _boxes_of(static: StaticMap, clearance: float) -> tuple[IntArray, FloatArray, FloatArray]:
    """Boxes around the contours.

    Returns:
        (C + 1,) where the corners of each contour start, (C, 2) the middles of the boxes [m], and
        (C, 2) half their sides [m].
    """
    contours = contours_of(static, clearance)
    points = contours.corners
    count = len(obstacles_of(static, clearance).radii)
    first = np.searchsorted(contours.owner, np.arange(count + 1)).astype(np.int64)
    low = np.minimum.reduceat(points, first[:-1]) if count else points
    high = np.maximum.reduceat(points, first[:-1]) if count else points
    return first, 0.5 * (low + high), 0.5 * (high - low)


@lru_cache(maxsize=8)
def _covered_sides(static: StaticMap, clearance: float) -> core.CoveredSides:
    contours = contours_of(static, clearance)
    bends = contours.corners, contours.incoming, contours.outgoing, contours.owner
    corners = core.Corners(*bends, *_boxes_of(static, clearance))
    return core.CoveredSides(corners, static.bounds, _CELL * clearance)


@lru_cache(maxsize=32)
def _obstacle_grid(static: StaticMap, clearance: float) -> core.ObstacleGrid:
    return core.ObstacleGrid(obstacles_of(static, clearance), gap_of(static))
