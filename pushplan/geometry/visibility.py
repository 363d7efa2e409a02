"""Compiled visibility graph around static obstacles, and the distance to a goal along it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.obstacles import Obstacles, line_of_sight
from pushplan.geometry.regions import Regions, nearest_in_region
from pushplan.world.checks import FloatArray, IntArray

NO_LEG = -2
"""Node index of a place from which nothing can be seen."""
GOAL_LEG = -1
"""Node index of a place from which the goal itself is the next stop."""


class Nodes(NamedTuple):
    """Places where a shortest path may bend or end, sorted by their distance to the goal."""

    points: FloatArray  # (V, 2) positions [m]
    # (V, 2) unit direction of the outline towards the node, 0 where it is no corner
    incoming: FloatArray
    outgoing: FloatArray  # (V, 2) unit direction of the outline away from the node
    # (V,) shortest distance from the node to the goal [m], inf if there is no way
    distances: FloatArray


class GoalScene(NamedTuple):
    """A goal among obstacles, as kernels read them."""

    regions: Regions  # ends of paths
    obstacles: Obstacles
    box: FloatArray  # (4,) x_min, y_min, x_max, y_max of where paths may lead [m]
    gap: float  # distance of paths to obstacles [m]


@kernel(inline=True)
def is_tangent(
    dx: float, dy: float, incoming: FloatArray, outgoing: FloatArray, k: int, gap: float
) -> bool:
    """Return True if a leg from (dx, dy) is tangent to corner ``k``, as shortest paths are."""
    before = incoming[k, 0] * dy - incoming[k, 1] * dx
    after = outgoing[k, 0] * dy - outgoing[k, 1] * dx
    return bool((before >= -gap and after <= gap) or (before <= gap and after >= -gap))


@kernel(allocates=True)
def visible_pairs(
    points: FloatArray,
    incoming: FloatArray,
    outgoing: FloatArray,
    obstacles: Obstacles,
    gap: float,
) -> tuple[IntArray, FloatArray]:
    """Pairs (E, 2) of corners that see each other along a common tangent; lengths (E,) [m]."""
    pairs = np.empty((64, 2), dtype=np.int64)
    lengths = np.empty(64)
    count = 0
    for i in range(points.shape[0]):
        for j in range(i + 1, points.shape[0]):
            dx = points[j, 0] - points[i, 0]
            dy = points[j, 1] - points[i, 1]
            if not (
                is_tangent(dx, dy, incoming, outgoing, i, gap)
                and is_tangent(-dx, -dy, incoming, outgoing, j, gap)
            ):
                continue
            if not line_of_sight(
                points[i, 0], points[i, 1], points[j, 0], points[j, 1], obstacles, gap
            ):
                continue
            if count == lengths.shape[0]:
                more_pairs = np.empty((2 * count, 2), dtype=np.int64)
                more_lengths = np.empty(2 * count)
                copy_into(more_pairs[:count], pairs)
                copy_into(more_lengths[:count], lengths)
                pairs = more_pairs
                lengths = more_lengths
            pairs[count, 0] = i
            pairs[count, 1] = j
            lengths[count] = math.hypot(dx, dy)
            count += 1
    return pairs[:count], lengths[:count]


@kernel(allocates=True)
def relax(
    distances: FloatArray, parents: IntArray, starts: IntArray, ends: IntArray, lengths: FloatArray
) -> None:
    """Dijkstra's algorithm from given first distances (V,) [m], in place."""
    done = np.zeros(distances.shape[0], dtype=np.bool_)
    for _ in range(distances.shape[0]):
        node = -1
        best = math.inf
        for i in range(distances.shape[0]):
            if not done[i] and distances[i] < best:
                node = i
                best = distances[i]
        if node < 0:
            return
        done[node] = True
        for e in range(starts[node], starts[node + 1]):
            other = ends[e]
            if best + lengths[e] < distances[other]:
                distances[other] = best + lengths[e]
                parents[other] = node


@kernel
def goal_leg(x: float, y: float, scene: GoalScene) -> tuple[float, float, float]:
    """The straight way from x, y to the nearest visible region: length [m] (inf) and its end."""
    regions, obstacles, box, gap = scene
    best = math.inf
    bx = x
    by = y
    count = regions.discs.shape[0] + regions.lines.shape[0] + regions.offsets.shape[0] - 1
    for k in range(count):
        qx, qy = nearest_in_region(k, x, y, regions)
        length = math.hypot(qx - x, qy - y)
        if (
            length < best
            and box[0] - gap <= qx <= box[2] + gap
            and box[1] - gap <= qy <= box[3] + gap
            and line_of_sight(x, y, qx, qy, obstacles, gap)
        ):
            best = length
            bx = qx
            by = qy
    return best, bx, by


@kernel
def node_leg(
    x: float,
    y: float,
    limit: float,  # a distance that is already known [m]; only a shorter one counts
    hint: int,  # node to try first, such as the one of a neighbour; negative for none
    tangent_only: bool,  # skip nodes that no shortest path can touch from a place off the contours
    nodes: Nodes,
    obstacles: Obstacles,
    gap: float,  # distance to keep from obstacles [m]
) -> tuple[float, int]:
    """The best node to walk to from x, y: distance to the goal over it [m] and its index."""
    best = limit
    found = NO_LEG
    count = nodes.points.shape[0]
    for trial in range(-1, count):
        i = trial
        if trial < 0:
            if hint < 0:
                continue
            i = hint
        elif nodes.distances[i] >= best:
            break
        dx = x - nodes.points[i, 0]
        dy = y - nodes.points[i, 1]
        left = best - nodes.distances[i]
        if dx * dx + dy * dy >= left * left or left <= 0.0:
            continue
        if tangent_only and not is_tangent(dx, dy, nodes.incoming, nodes.outgoing, i, gap):
            continue
        length = nodes.distances[i] + math.sqrt(dx * dx + dy * dy)
        if length < best and line_of_sight(
            x, y, nodes.points[i, 0], nodes.points[i, 1], obstacles, gap
        ):
            best = length
            found = i
    return best, found
