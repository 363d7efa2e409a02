"""`VisibilityGraph`: shortest paths for a disc, of which only what is needed is made."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from pushplan.compiled import owned
from pushplan.geometry.contours import contours_of, gap_of, prepare_contours, standoff_of
from pushplan.geometry.obstacle_grid import obstacle_grid
from pushplan.geometry.obstacles import obstacles_of
from pushplan.geometry.regions import Target, as_target, outside_area, regions_of
from pushplan.geometry.shortest_path import Path, ends_on_rims, leave_inflation, with_way_out
from pushplan.geometry.visibility import GoalScene
from pushplan.geometry.visibility_search import (
    EXHAUSTED,
    FULL,
    PAUSED,
    START,
    Corners,
    VisibilitySearch,
    bounds_by_obstacle,
    expand,
    new_frontier,
    path_found,
    search_on,
)
from pushplan.world import Goal, StaticMap
from pushplan.world.checks import FloatArray, array, frozen, number

_BUDGET = 20_000  # work of a search between two looks at a stop rule: about a millisecond


class VisibilityGraph:
    """Shortest paths for a disc-shaped robot among the obstacles of one map.

    Straight walls and polygons are exact; where a path bends around an arc (a thick segment's end,
    a corner at a clearance), that arc comes out at most 0.07 % too long. Paths stay inside
    ``static.bounds`` and may touch obstacles; obstacles that touch each other leave no passage.
    Only what a path may need of the graph is made. `goal_distances` makes all of it, and pays where
    many paths lead to one goal.

    Args:
        static: obstacles and bounds.
        clearance: distance that paths keep from obstacles [m], such as the robot's radius.

    Raises:
        InvalidInputError: if the clearance is negative.
    """

    def __init__(self, static: StaticMap, clearance: float = 0.0) -> None:
        self.static = static
        self.clearance = number("clearance", clearance, low=0.0)

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
        search = _visibility_search(self.static, self.clearance, target, free)
        frontier = new_frontier(8 * len(search.done) + 64)
        expand(search, frontier, START, 0.0, -math.inf)
        outcome = PAUSED
        while outcome in (PAUSED, FULL):
            if stopped():
                return Path(math.inf)
            outcome = search_on(search, frontier, _BUDGET)
            if outcome == FULL:
                frontier = frontier.larger()
        if outcome == EXHAUSTED:
            return Path(math.inf)
        return with_way_out(origin, free, gap_of(self.static), path_found(search))


@lru_cache(maxsize=32)
def _corners_of(static: StaticMap, clearance: float) -> Corners:
    """The corners of all contours, without ends."""
    contours = contours_of(static, clearance)
    points = contours.corners
    count = len(obstacles_of(static, clearance).radii)
    first = np.searchsorted(contours.owner, np.arange(count + 1)).astype(np.int64)
    low = np.minimum.reduceat(points, first[:-1]) if count else points
    high = np.maximum.reduceat(points, first[:-1]) if count else points
    return Corners(
        *(points, contours.incoming, contours.outgoing, contours.owner, frozen(first)),
        frozen(0.5 * (low + high)),
        frozen(0.5 * (high - low)),
    )


def _visibility_search(
    static: StaticMap, clearance: float, target: Target, start: FloatArray
) -> VisibilitySearch:
    """A search that knows nothing yet but the map and where it begins and ends."""
    regions = regions_of(target)
    gap = gap_of(static)
    shapes = obstacles_of(static, clearance)
    corners = _corners_of(static, clearance)
    ends = ends_on_rims(static, clearance, regions)
    points = np.concatenate([corners.points, ends])
    scene = GoalScene(regions, shapes, static.bounds, gap)
    return VisibilitySearch(
        start=owned(start),
        corners=corners._replace(points=points),
        scene=scene,
        grid=obstacle_grid(static, clearance, gap),
        sliver=standoff_of(static, clearance),
        done=np.zeros(len(points), dtype=np.bool_),
        parents=np.full(len(points), START, dtype=np.int64),
        counters=np.array([0, 0, 0, START]),
        seen=np.zeros(len(shapes.radii) + 1, dtype=np.int64),
        left=bounds_by_obstacle(corners, scene),
    )
