"""Static obstacles as compiled kernels read them: convex cores, each with a radius around it.

A thick segment is exactly the points within its radius of its centre line, and a polygon grown by
a clearance the points within that clearance of the polygon. Both are a *core* (2 or more corners)
and a radius, so distances and lines of sight need no approximation of round corners.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.convex import point_segment_distance_sq
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen
from pushplan.world.outline import flatten, outline_boxes


class Obstacles(NamedTuple):
    """C grown convex cores; a plain tuple of arrays, so that it can be passed into kernels."""

    # (V, 2) corners of the cores [m], each counter-clockwise; a segment has two
    vertices: FloatArray
    offsets: IntArray  # (C + 1,) where each core starts
    radii: FloatArray  # (C,) how far each obstacle reaches beyond its core [m]
    boxes: FloatArray  # (C, 4) x_min, y_min, x_max, y_max of each obstacle [m]


@lru_cache(maxsize=64)
def obstacles_of(static: StaticMap, clearance: float = 0.0) -> Obstacles:
    """The cores of a static map, grown by ``clearance`` [m]; kept for the maps used last."""
    cores = [*static.polygons, *(line.reshape(2, 2) for line in static.segments)]
    vertices, offsets = flatten(cores)
    radii = np.concatenate([np.zeros(len(static.polygons)), static.radii]) + clearance
    boxes = outline_boxes(vertices, offsets) + radii[:, None] * [-1.0, -1.0, 1.0, 1.0]
    return Obstacles(vertices, offsets, frozen(radii), frozen(boxes))


@kernel
def core_distance(x: float, y: float, vertices: FloatArray, first: int, last: int) -> float:
    """Signed distance [m] of a point to the core ``vertices[first:last]``, negative inside."""
    best_sq = math.inf
    inside = last - first > 2
    for i in range(first, last):
        j = i + 1 if i + 1 < last else first
        ax = vertices[i, 0]
        ay = vertices[i, 1]
        bx = vertices[j, 0]
        by = vertices[j, 1]
        best_sq = min(best_sq, point_segment_distance_sq(x, y, ax, ay, bx, by))
        if (bx - ax) * (y - ay) - (by - ay) * (x - ax) < 0.0:
            inside = False
    distance = math.sqrt(best_sq)
    return -distance if inside else distance


@kernel
def obstacle_distance(x: float, y: float, obstacles: Obstacles) -> float:
    """Distance [m] to the nearest obstacle: minus the greatest depth inside, inf without any."""
    best = math.inf
    vertices, offsets, radii, _ = obstacles
    for k in range(radii.shape[0]):
        best = min(best, core_distance(x, y, vertices, offsets[k], offsets[k + 1]) - radii[k])
    return best


@kernel
def _segments_closer(
    px: float,
    py: float,
    qx: float,
    qy: float,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    reach_sq: float,
) -> bool:
    """Return True if the segments p-q and a-b cross or are closer than the root of ``reach_sq``."""
    dx = qx - px
    dy = qy - py
    ex = bx - ax
    ey = by - ay
    sa = dx * (ay - py) - dy * (ax - px)
    sb = dx * (by - py) - dy * (bx - px)
    sp = ex * (py - ay) - ey * (px - ax)
    sq = ex * (qy - ay) - ey * (qx - ax)
    if ((sa > 0.0) != (sb > 0.0)) and ((sp > 0.0) != (sq > 0.0)):
        return True
    return (
        point_segment_distance_sq(px, py, ax, ay, bx, by) < reach_sq
        or point_segment_distance_sq(qx, qy, ax, ay, bx, by) < reach_sq
        or point_segment_distance_sq(ax, ay, px, py, qx, qy) < reach_sq
        or point_segment_distance_sq(bx, by, px, py, qx, qy) < reach_sq
    )


@kernel
def crosses_obstacle(
    px: float, py: float, qx: float, qy: float, obstacles: Obstacles, k: int, margin: float
) -> bool:
    """Return True if the segment p-q comes closer than ``margin`` [m] to obstacle ``k``."""
    vertices, offsets, radii, boxes = obstacles
    if (
        max(px, qx) < boxes[k, 0] - margin
        or min(px, qx) > boxes[k, 2] + margin
        or max(py, qy) < boxes[k, 1] - margin
        or min(py, qy) > boxes[k, 3] + margin
    ):
        return False
    dx = qx - px
    dy = qy - py
    length = math.sqrt(dx * dx + dy * dy)
    ux, uy = (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)
    reach = max(0.0, radii[k] + margin)
    first = offsets[k]
    last = offsets[k + 1]
    # extent of the core across the line
    low = math.inf
    high = -math.inf
    for i in range(first, last):
        side = ux * (vertices[i, 1] - py) - uy * (vertices[i, 0] - px)
        low = min(low, side)
        high = max(high, side)
    if low >= reach or high <= -reach:
        return False
    if last - first > 2 and core_distance(px, py, vertices, first, last) < 0.0:
        return True
    for i in range(first, last):
        j = i + 1 if i + 1 < last else first
        ax = vertices[i, 0]
        ay = vertices[i, 1]
        bx = vertices[j, 0]
        by = vertices[j, 1]
        if _segments_closer(px, py, qx, qy, ax, ay, bx, by, reach * reach):
            return True
    return False


@kernel
def line_of_sight(
    px: float, py: float, qx: float, qy: float, obstacles: Obstacles, margin: float
) -> bool:
    """Return True if the segment p-q stays ``margin`` [m], at least, away from all obstacles."""
    for k in range(obstacles.radii.shape[0]):
        if crosses_obstacle(px, py, qx, qy, obstacles, k, margin):
            return False
    return True
