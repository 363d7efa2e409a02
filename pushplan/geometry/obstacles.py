"""Static obstacles as the core reads them: convex cores, each with a radius around it.

A thick segment is exactly the points within its radius of its centre line, and a polygon grown by
a clearance the points within that clearance of the polygon. Both are a *core* (2 or more corners)
and a radius, so distances and lines of sight need no approximation of round corners.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pushplan.core import geometry as core
from pushplan.geometry.polygon import corners
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray, array, frozen, integer, number
from pushplan.world.outline import flatten, outline_boxes


@lru_cache(maxsize=64)
def obstacles_of(static: StaticMap, clearance: float = 0.0) -> core.Obstacles:
    """The cores of a static map, grown by ``clearance`` [m]; kept for the maps used last."""
    vertices, offsets = static.packed
    if len(static.segments):
        vertices, offsets = flatten([*static.polygons, *static.segments.reshape(-1, 2, 2)])
    radii = np.concatenate([np.zeros(len(static.polygons)), static.radii]) + clearance
    boxes = outline_boxes(vertices, offsets) + radii[:, None] * [-1.0, -1.0, 1.0, 1.0]
    return core.Obstacles(vertices, offsets, frozen(radii), frozen(boxes))


def core_distance(x: float, y: float, vertices: FloatArray, first: int, last: int) -> float:
    """Signed distance [m] of a point to the core ``vertices[first:last]``, negative inside."""
    every: FloatArray = array("vertices", vertices, (None, 2))
    begin = integer("first", first, low=0, high=len(every))
    core_vertices = corners("vertices[first:last]", every[begin : integer("last", last)])
    return core.core_distance(number("x", x), number("y", y), core_vertices)
