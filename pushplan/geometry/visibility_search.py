"""Lazy A* over the visibility graph: edges are tested when they are about to be used.

A node is a corner of a contour. When one is reached, its successors are the corners that a common
tangent leads to; they are put into the heap untested, and whether nothing lies between is found
out for the cheapest entry only (Dellin and Srinivasa, "A unifying formalism for shortest path
problems with expensive edge evaluations", 2016). Nor are all successors put there at once: those
through which the way to the goal would be much longer wait until it is their turn (Yoshizumi, Miura
and Ishida, "A* with partial expansion for large branching factor problems", 2000). Most of the
graph is never made.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.obstacle_grid import ObstacleGrid, sees
from pushplan.geometry.obstacles import core_distance
from pushplan.geometry.regions import nearest_in_region
from pushplan.geometry.visibility import GoalScene, goal_leg, is_tangent
from pushplan.search.heap import pop_least, push_or_lift
from pushplan.world.checks import BoolArray, FloatArray, IntArray

FOUND = 0
EXHAUSTED = 1
PAUSED = 2
FULL = 3
"""Results of `search`: path found, no path exists, budget used up, more memory is needed."""
START = -1
"""Index of the start among the nodes."""
_USED = 1
_TESTED = 2
_END = 3


class Corners(NamedTuple):
    """Corners by obstacle, then points where the goal's rim leaves an obstacle."""

    points: FloatArray  # (V + E, 2) [m]
    incoming: FloatArray  # (V, 2) as in `Contours`
    outgoing: FloatArray  # (V, 2)
    owner: IntArray  # (V,) obstacle
    first: IntArray  # (C + 1,) where the corners of each obstacle start
    middles: FloatArray  # (C, 2) of the boxes around the contours [m]
    halves: FloatArray  # (C, 2) half their sides [m]


class Frontier(NamedTuple):
    """Entries of the heap: ways of getting to a node, most of them not tested yet."""

    keys: FloatArray  # (M,) in heap order, length plus bound [m]
    lengths: FloatArray  # (M,) length of the path to the node [m]
    limits: FloatArray  # (M,) of the rest of an expansion: the least that is left to offer [m]
    heap: IntArray  # (M,)
    places: IntArray  # (M,)
    nodes: IntArray  # (M,)
    before: IntArray  # (M,) the node before, `START` for none

    def larger(self) -> Frontier:
        """Twice the memory, with the same entries."""
        return Frontier(*(np.concatenate([part, np.empty_like(part)]) for part in self))


class VisibilitySearch(NamedTuple):
    """A search from one start to one goal, which can be taken up again."""

    start: FloatArray  # (2,) [m]
    corners: Corners
    scene: GoalScene
    grid: ObstacleGrid
    sliver: float  # a place this close to an obstacle may be inside of its contour [m]
    done: BoolArray  # (V + E,)
    parents: IntArray  # (V + E,)
    counters: IntArray  # (4,) size of the heap, entries used, lines tested, last node or `START`
    seen: IntArray  # (C + 1,) memory of `sees`
    left: FloatArray  # (C,) from any corner of an obstacle at least as far to the goal [m]


@kernel
def _bound(x: float, y: float, scene: GoalScene) -> float:
    """Straight distance [m] to the goal."""
    best = math.inf
    regions = scene.regions
    count = regions.discs.shape[0] + regions.lines.shape[0] + regions.offsets.shape[0] - 1
    for k in range(count):
        qx, qy = nearest_in_region(k, x, y, regions)
        best = min(best, math.hypot(qx - x, qy - y))
    return best


@kernel(allocates=True)
def bounds_by_obstacle(corners: Corners, scene: GoalScene) -> FloatArray:
    """(C,) straight distance [m] to the goal, at least, from every corner of each obstacle."""
    left = np.empty(corners.middles.shape[0])
    for k in range(left.shape[0]):
        half = math.hypot(corners.halves[k, 0], corners.halves[k, 1])
        left[k] = _bound(corners.middles[k, 0], corners.middles[k, 1], scene) - half
    return left


@kernel
def _offer(
    search: VisibilitySearch,
    frontier: Frontier,
    node: int,
    length: float,
    bound: float,
    before: int,
) -> None:
    """Put a way of getting to a node into the heap."""
    entry = search.counters[_USED]
    search.counters[_USED] = entry + 1
    frontier.lengths[entry] = length
    frontier.nodes[entry] = node
    frontier.before[entry] = before
    frontier.places[entry] = -1
    keys = frontier.keys
    heap = frontier.heap
    places = frontier.places
    push_or_lift(keys, heap, places, search.counters, entry, length + bound)


@kernel
def expand(
    search: VisibilitySearch, frontier: Frontier, at: int, length: float, low: float
) -> None:
    """Offer the goal and corners that a common tangent leads to from node ``at``.

    Only corners through which the goal is farther than ``low`` [m], -inf at first, and not much
    farther; an entry stands for the rest.
    """
    corners = search.corners
    scene = search.scene
    gap = search.scene.gap
    count = corners.owner.shape[0]
    box = scene.box
    point = corners.points
    x = search.start[0]
    y = search.start[1]
    own = -1
    ix = iy = ox = oy = 0.0
    if at >= 0:
        x = point[at, 0]
        y = point[at, 1]
        own = corners.owner[at]
        ix = corners.incoming[at, 0]
        iy = corners.incoming[at, 1]
        ox = corners.outgoing[at, 0]
        oy = corners.outgoing[at, 1]
    straight = _bound(x, y, scene)
    high = straight + 2.0 * (low - straight)
    rest = False
    if low == -math.inf:
        high = straight + search.grid.cell
        leg, _, _ = goal_leg(x, y, scene)
        if leg < math.inf:
            _offer(search, frontier, point.shape[0], length + leg, 0.0, at)
        for j in range(count, point.shape[0]):
            dx = point[j, 0] - x
            dy = point[j, 1] - y
            if at < 0 or is_tangent(dx, dy, corners.incoming, corners.outgoing, at, gap):
                _offer(search, frontier, j, length + math.hypot(dx, dy), 0.0, at)
    obstacles = scene.obstacles
    for k in range(corners.middles.shape[0]):
        mx = corners.middles[k, 0] - x
        my = corners.middles[k, 1] - y
        hx = corners.halves[k, 0]
        hy = corners.halves[k, 1]
        ax = max(abs(mx) - hx, 0.0)
        ay = max(abs(my) - hy, 0.0)
        away = high - search.left[k]  # farther than that the goal is too far from its corners
        if away < 0.0 or ax * ax + ay * ay > away * away:
            rest = True
            continue
        first = corners.first[k]
        last = corners.first[k + 1]
        every = k == own
        if at < 0:
            away = core_distance(
                x, y, obstacles.vertices, obstacles.offsets[k], obstacles.offsets[k + 1]
            )
            every = away - obstacles.radii[k] <= search.sliver
        elif not every:  # the box around it must reach into where tangents at this corner lead
            before = ix * my - iy * mx
            after = ox * my - oy * mx
            b = abs(ix) * hy + abs(iy) * hx + gap
            a = abs(ox) * hy + abs(oy) * hx + gap
            if not ((before >= -b and after <= a) or (before <= b and after >= -a)):
                continue
        for j in range(first, last):
            if search.done[j]:
                continue
            px = point[j, 0]
            py = point[j, 1]
            if not (box[0] - gap <= px <= box[2] + gap and box[1] - gap <= py <= box[3] + gap):
                continue
            dx = px - x
            dy = py - y
            if not every and not is_tangent(-dx, -dy, corners.incoming, corners.outgoing, j, gap):
                continue
            if at >= 0 and not is_tangent(dx, dy, corners.incoming, corners.outgoing, at, gap):
                continue
            step = math.hypot(dx, dy)
            bound = _bound(px, py, scene)
            if step + bound > high:
                rest = True
            elif step + bound > low:
                _offer(search, frontier, j, length + step, bound, at)
    if rest:
        frontier.limits[search.counters[_USED]] = high
        _offer(search, frontier, point.shape[0] + 1, length, high, at)


@kernel
def search_on(search: VisibilitySearch, frontier: Frontier, budget: int) -> int:
    """Take up the search for about ``budget`` corners looked at, or lines tested."""
    corners = search.corners
    scene = search.scene
    counters = search.counters
    most = corners.points.shape[0] + 2
    count = corners.owner.shape[0]
    while budget > 0:
        if counters[0] == 0:
            return EXHAUSTED
        if counters[_USED] + most > frontier.nodes.shape[0]:
            return FULL
        entry = pop_least(frontier.keys, frontier.heap, frontier.places, counters)
        node = frontier.nodes[entry]
        before = frontier.before[entry]
        budget -= 1
        if node == corners.points.shape[0]:  # its line has been tested
            counters[_END] = before
            return FOUND
        if node > corners.points.shape[0]:
            expand(search, frontier, before, frontier.lengths[entry], frontier.limits[entry])
            budget -= corners.middles.shape[0] + 8
            continue
        if search.done[node]:
            continue
        x = search.start[0]
        y = search.start[1]
        if before >= 0:
            x = corners.points[before, 0]
            y = corners.points[before, 1]
        counters[_TESTED] += 1
        budget -= 8
        qx = corners.points[node, 0]
        qy = corners.points[node, 1]
        if not sees(x, y, qx, qy, scene.obstacles, scene.gap, search.grid, search.seen):
            continue
        search.done[node] = True
        search.parents[node] = before
        if node >= count:
            counters[_END] = node
            return FOUND
        expand(search, frontier, node, frontier.lengths[entry], -math.inf)
        budget -= corners.middles.shape[0] + 8
    return PAUSED


def new_frontier(capacity: int) -> Frontier:
    """Memory for entries."""
    keys, lengths, limits = (np.empty(capacity) for _ in range(3))
    numbers = [np.empty(capacity, dtype=np.int64) for _ in range(4)]
    return Frontier(keys, lengths, limits, *numbers)


def path_found(search: VisibilitySearch) -> tuple[float, list[FloatArray]]:
    """Length [m] and points (2,) [m] of the path that a search has found, from its start."""
    points = search.corners.points
    at = int(search.counters[_END])
    total = 0.0
    path = []
    if at < len(search.corners.owner):  # it goes on into the goal
        x, y = (search.start if at == START else points[at]).tolist()
        total, qx, qy = goal_leg(x, y, search.scene)
        if total > 0.0:
            path.append(np.array([qx, qy]))
    while at != START:
        path.append(points[at])
        at = int(search.parents[at])
    path.append(search.start)
    for here, there in pairwise(path[1 if total > 0.0 else 0 :]):
        total += math.hypot(*(there - here))
    return total, path[::-1]
