"""Exact shortest paths around static obstacles, to a point or to the nearest point of a goal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.geometry.obstacles import grown_map
from pushplan.geometry.regions import Target, as_target, outside_area, regions_of
from pushplan.world import Goal, StaticMap
from pushplan.world.checks import ArrayRecord, FloatArray, array, boolean, expect, number
from pushplan.world.static_map import core_map

_USUAL = core.Estimates.WHEN_SLOW


@dataclass(frozen=True, eq=False)
class Path(ArrayRecord):
    """A polygonal path; without a way, ``length`` is inf and there are no points.

    Args:
        length: [m].
        points: (N, 2) from the start to the end, world frame [m].
    """

    length: float
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", array("path.points", self.points, (None, 2)))


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
        estimates = core.Estimates.NEVER if self.exact else _USUAL
        search = core.ShortestPath(
            core_map(self.static), self.clearance, origin, regions_of(target), estimates
        )
        while not stopped():
            if search.run():
                return Path(*search.path)
        return Path(math.inf)


@dataclass(frozen=True, eq=False)
class GoalDistances:
    """Shortest distances from every bend of the map to one goal; what queries are answered from.

    Attributes:
        static: the map.
        clearance: distance of paths from obstacles [m].
        target: the goal.
        to_center: True if distances to a disc are those to its centre.
        in_core: the distances.
    """

    static: StaticMap
    clearance: float
    target: Target
    to_center: bool
    in_core: core.GoalDistances

    @property
    def gap(self) -> float:
        """Distance of paths to the grown obstacles [m]."""
        return grown_map(self.static, self.clearance).gap

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is made anew, as objects of the core cannot be pickled."""
        return _distances, (self.static, self.clearance, self.target, self.to_center)

    def path_from(self, start: ArrayLike) -> Path:
        """The shortest path from a point (2,) [m] to the goal."""
        origin: FloatArray = array("start", start, (2,))
        if outside_area(self.target, origin):
            return Path(0.0, origin[None])
        return Path(*self.in_core.path_from(origin))


@lru_cache(maxsize=128)
def _distances(
    static: StaticMap, clearance: float, target: Target, to_center: bool
) -> GoalDistances:
    regions = regions_of(target, to_center=to_center)
    in_core = core.GoalDistances(core_map(static), clearance, regions)
    return GoalDistances(static, clearance, target, to_center, in_core)


def goal_distances(
    static: StaticMap,
    goal: Goal | Sequence[ArrayLike],
    *,
    clearance: float = 0.0,
    to_center: bool = False,
) -> GoalDistances:
    """Shortest distances to a goal, kept for the maps and goals used last.

    Args:
        static: obstacles, and bounds that paths may not leave.
        goal: a disc, a line, a receptacle, or a list of convex polygons (N, 2) and segments
            (2, 2) [m]. For a clearance area distances are those to the nearest open edge, and 0
            for what lies outside the area.
        clearance: distance that paths keep from obstacles [m].
        to_center: measure to the centre of a disc instead of to its rim.

    Raises:
        InvalidInputError: if the goal is none of these, or the clearance is negative.
    """
    expect("static", static, StaticMap)
    margin = number("clearance", clearance, low=0.0)
    return _distances(static, margin, as_target(goal), boolean("to_center", to_center))
