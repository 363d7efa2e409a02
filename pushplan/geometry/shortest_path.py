"""Exact shortest paths around static obstacles, to a point or to the nearest point of a goal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.geometry.contours import (
    Contours,
    box_edges,
    contour_edges,
    contours_of,
    gap_of,
    standoff_of,
)
from pushplan.geometry.obstacles import obstacles_of
from pushplan.geometry.regions import (
    Target,
    as_target,
    outside_area,
    region_crossings,
    regions_of,
)
from pushplan.world import Goal, StaticMap
from pushplan.world.checks import (
    ArrayRecord,
    FloatArray,
    IntArray,
    array,
    boolean,
    expect,
    frozen,
    number,
)

NO_LEG = -2
"""Node index of a place from which nothing can be seen."""
GOAL_LEG = -1
"""Node index of a place from which the goal itself is the next stop."""


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


class _Graph(NamedTuple):
    """Part of the visibility graph that depends on the map alone."""

    contours: Contours  # only corners where a path can be
    starts: IntArray
    ends: IntArray
    lengths: FloatArray


@lru_cache(maxsize=32)
def _graph_of(static: StaticMap, clearance: float) -> _Graph:
    shapes = obstacles_of(static, clearance)
    gap = gap_of(static)
    every = contours_of(static, clearance)
    keep = shapes.free_points(every.corners, static.bounds, gap)
    kept = Contours(*(frozen(np.ascontiguousarray(values[keep])) for values in every))
    pairs, lengths = core.visible_pairs(kept.bends, shapes, gap)
    tails = np.concatenate([pairs[:, 0], pairs[:, 1]])
    heads = np.concatenate([pairs[:, 1], pairs[:, 0]])
    order = np.argsort(tails, kind="stable")
    starts = np.zeros(len(kept.corners) + 1, dtype=np.int64)
    np.cumsum(np.bincount(tails, minlength=len(kept.corners)), out=starts[1:])
    return _Graph(kept, starts, heads[order], np.concatenate([lengths, lengths])[order])


def bends_of(static: StaticMap, clearance: float = 0.0) -> tuple[Contours, FloatArray]:
    """Return the bends of shortest paths, and the (B, B) shortest distances between them [m]."""
    graph = _graph_of(static, clearance)
    count = len(graph.contours.corners)
    between = np.full((count, count), np.inf)
    for k in range(count):
        between[k, k] = 0.0
        unused = np.full(count, GOAL_LEG, dtype=np.int64)
        core.relax(graph.starts, graph.ends, graph.lengths, between[k], unused)
    return graph.contours, frozen(between)


def with_way_out(
    origin: FloatArray, free: FloatArray, gap: float, found: tuple[float, list[FloatArray]]
) -> Path:
    """A path from ``free``, led there from where the robot is."""
    length, points = found
    away = float(np.hypot(*(free - origin)))
    if away > 2.5 * gap:
        points = [origin, *points]
        length += away
    elif points:
        points[0] = origin
    if not math.isfinite(length):
        return Path(math.inf)
    return Path(length, np.array(points))


@dataclass(frozen=True, eq=False)
class GoalDistances:
    """Shortest distances from every bend of the map to one goal; what queries are answered from.

    Attributes:
        static: the map.
        clearance: distance of paths from obstacles [m].
        target: the goal.
        to_center: True if distances to a disc are those to its centre.
        scene: where paths to it end, and the obstacles grown by the clearance.
        nodes: bends, sorted by distance.
        places: (V, 2) where they are [m].
        parents: (V,) the next bend towards the goal, or `GOAL_LEG`.
        exits: (V, 2) where the leg to the goal ends [m], for nodes whose parent is `GOAL_LEG`.
    """

    static: StaticMap
    clearance: float
    target: Target
    to_center: bool
    scene: core.GoalScene
    nodes: core.Nodes
    places: FloatArray
    parents: IntArray
    exits: FloatArray

    @property
    def gap(self) -> float:
        """Distance of paths to the grown obstacles [m]."""
        return gap_of(self.static)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is made anew, as objects of the core cannot be pickled."""
        return _distances, (self.static, self.clearance, self.target, self.to_center)

    def path_from(self, start: ArrayLike) -> Path:
        """The shortest path from a point (2,) [m] to the goal."""
        origin: FloatArray = array("start", start, (2,))
        if outside_area(self.target, origin):
            return Path(0.0, origin[None])
        free = leave_inflation(self.static, self.clearance, origin)
        if free is None:
            return Path(math.inf)
        return with_way_out(origin, free, self.gap, self._from_free(free))

    def _from_free(self, start: FloatArray) -> tuple[float, list[FloatArray]]:
        x, y = start.tolist()
        length, qx, qy = self.scene.goal_leg(x, y)
        if length == 0.0:
            return 0.0, [start]
        over, node = self.scene.node_leg(x, y, length, NO_LEG, False, self.nodes)
        if node == NO_LEG:
            return length, [start, np.array([qx, qy])]
        points = [start]
        while node != GOAL_LEG:
            points.append(self.places[node])
            last = node
            node = int(self.parents[node])
        if (self.exits[last] != self.places[last]).any():
            points.append(self.exits[last])
        return over, points


@lru_cache(maxsize=128)
def _distances(
    static: StaticMap, clearance: float, target: Target, to_center: bool
) -> GoalDistances:
    regions = regions_of(target, to_center=to_center)
    graph = _graph_of(static, clearance)
    shapes = obstacles_of(static, clearance)
    gap = gap_of(static)
    ends = ends_on_rims(static, clearance, regions)
    corners = graph.contours
    count = len(corners.corners)
    scene = core.GoalScene(regions, shapes, static.bounds, gap)
    legs = scene.goal_legs(corners.corners)
    discs = np.hstack([ends, np.zeros((len(ends), 1))])
    none = np.zeros((0, 4)), np.zeros((0, 2)), np.zeros(1, dtype=np.int64)
    rims = core.GoalScene(core.Regions(discs, *none), shapes, static.bounds, gap).goal_legs(
        corners.corners
    )
    legs = np.where((rims[:, 0] < legs[:, 0])[:, None], rims, legs)
    distances = legs[:, 0].copy()
    parents = np.full(count, GOAL_LEG, dtype=np.int64)
    core.relax(graph.starts, graph.ends, graph.lengths, distances, parents)
    zeros = np.zeros((len(ends), 2))
    distances = np.concatenate([distances, np.zeros(len(ends))])
    order = np.argsort(distances, kind="stable")
    order = order[np.isfinite(distances[order])]
    rank = np.full(len(distances) + 1, GOAL_LEG, dtype=np.int64)  # the last entry serves GOAL_LEG
    rank[order] = np.arange(len(order))
    parents = np.concatenate([parents, np.full(len(ends), GOAL_LEG, dtype=np.int64)])
    places = frozen(np.concatenate([corners.corners, ends])[order])
    incoming = np.concatenate([corners.incoming, zeros])[order]
    outgoing = np.concatenate([corners.outgoing, zeros])[order]
    nodes = core.Nodes(core.Bends(places, incoming, outgoing), distances[order])
    exits = np.concatenate([legs[:, 1:], ends])[order]
    ways = rank[parents[order]]
    return GoalDistances(static, clearance, target, to_center, scene, nodes, places, ways, exits)


def ends_on_rims(static: StaticMap, clearance: float, regions: core.Regions) -> FloatArray:
    """Find (N, 2) points [m] where a path may end at the rim of what covers a part of the goal."""
    shapes = obstacles_of(static, clearance)
    contours = contours_of(static, clearance)
    which = None
    if not len(regions.half_planes):  # only obstacles near it can cover a part of it
        around = np.concatenate([regions.discs[:, :2], regions.vertices])
        reach = regions.discs[:, 2].max(initial=0.0) + standoff_of(static, clearance)
        low = around.min(axis=0, initial=np.inf) - reach
        high = around.max(axis=0, initial=-np.inf) + reach
        near = ((shapes.boxes[:, :2] <= high) & (shapes.boxes[:, 2:] >= low)).all(axis=1)
        which = near[contours.owner]
    rims = [contour_edges(contours, which), box_edges(static.bounds)]
    ends = region_crossings(regions, np.concatenate(rims))
    return ends[shapes.free_points(ends, static.bounds, gap_of(static))]


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


def leave_inflation(static: StaticMap, clearance: float, point: FloatArray) -> FloatArray | None:
    """The nearest place (2,) [m] that keeps the clearance; None from inside an obstacle.

    A robot that touches a wall has its centre a little too close to it. The way out is straight
    and does not cross an obstacle itself.
    """
    x, y = point.tolist()
    gap = gap_of(static)
    raw = obstacles_of(static)
    grown = obstacles_of(static, clearance)
    if raw.distance(x, y) < -gap:
        return None
    if grown.distance(x, y) >= gap:
        return point
    away = np.maximum(np.maximum(grown.boxes[:, :2] - point, point - grown.boxes[:, 2:]), 0.0)
    distances = np.hypot(away[:, 0], away[:, 1])
    reach = 2.0 * float(grown.radii.max()) + gap
    while True:  # among the obstacles nearby, or among all
        near = np.flatnonzero(distances <= reach)
        found = [_ways_out(static, clearance, near), _pushed_out(point, grown, near, 2.0 * gap)]
        places = np.ascontiguousarray(np.concatenate(found))
        places = places[grown.free_points(places, static.bounds, gap)]
        steps = np.hypot(*(places - point).T)
        for i in np.argsort(steps, kind="stable").tolist():
            px, py = places[i].tolist()
            if steps[i] <= reach and raw.line_of_sight(x, y, px, py, -2.0 * gap):
                place: FloatArray = places[i]
                return place
        if len(near) == len(distances) and not (steps > reach).any():
            return None
        reach *= 2.0


def _ways_out(static: StaticMap, clearance: float, near: IntArray) -> FloatArray:
    """Find where outlines of the obstacles ``near`` cross each other or the bounds, (N, 2) [m]."""
    contours = contours_of(static, clearance)
    which = np.isin(contours.owner, near)
    edges = contour_edges(contours, which)
    owner = contours.owner[which]
    found = [core.segment_crossings(box_edges(static.bounds), edges)]
    found += [core.segment_crossings(edges[owner == k], edges[owner > k]) for k in near.tolist()]
    return np.ascontiguousarray(np.concatenate(found))


def _pushed_out(
    point: FloatArray, shapes: core.Obstacles, near: IntArray, extra: float
) -> FloatArray:
    """The point (2,) carried straight to ``extra`` [m] outside obstacles ``near``, as (C, 2)."""
    found = np.empty((len(near), 2))
    for i, k in enumerate(near.tolist()):
        radius = float(shapes.radii[k])
        core = shapes.vertices[shapes.offsets[k] : shapes.offsets[k + 1]]
        edges = np.roll(core, -1, axis=0) - core
        fraction = ((point - core) * edges).sum(axis=1) / np.maximum((edges**2).sum(axis=1), 1e-300)
        feet = core + np.clip(fraction, 0.0, 1.0)[:, None] * edges
        away = point - feet
        nearest = int(np.argmin(np.hypot(away[:, 0], away[:, 1])))
        direction = away[nearest]
        if not direction.any():  # on the outline of the core: straight out of the edge
            direction = np.array([edges[nearest, 1], -edges[nearest, 0]])
        size = float(np.hypot(*direction))
        unit = direction / size if size > 0.0 else np.array([1.0, 0.0])
        found[i] = feet[nearest] + (radius + extra) * unit
    return found
