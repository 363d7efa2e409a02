"""Obstacles grown by a clearance, and distances to them."""

from __future__ import annotations

from pushplan.core import geometry as core
from pushplan.geometry.polygon import corners
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray, array, integer, number
from pushplan.world.static_map import core_map


def grown_map(static: StaticMap, clearance: float = 0.0) -> core.GrownMap:
    """The map with everything grown by ``clearance`` [m], kept with it."""
    return core_map(static).grown(clearance)


def core_distance(x: float, y: float, vertices: FloatArray, first: int, last: int) -> float:
    """Signed distance [m] of a point to the core ``vertices[first:last]``, negative inside."""
    every: FloatArray = array("vertices", vertices, (None, 2))
    begin = integer("first", first, low=0, high=len(every))
    core_vertices = corners("vertices[first:last]", every[begin : integer("last", last)])
    return core.core_distance(number("x", x), number("y", y), core_vertices)
