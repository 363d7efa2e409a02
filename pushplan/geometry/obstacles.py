"""Static obstacles as the core reads them: convex cores, each with a radius around it.

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
from pushplan.core import geometry as core
from pushplan.geometry.convex import point_segment_distance_sq
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen
from pushplan.world.outline import flatten, outline_boxes


class Obstacles(NamedTuple):
    """C grown convex cores."""

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


@lru_cache(maxsize=64)
def core_obstacles(static: StaticMap, clearance: float = 0.0) -> core.Obstacles:
    """`obstacles_of` for the core."""
    return core.Obstacles(*obstacles_of(static, clearance))


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
