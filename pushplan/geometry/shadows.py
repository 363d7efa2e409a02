"""Distances from a moving viewpoint around static obstacles, fast enough for every control step.

A raster holds, for each cell, the exact distances to the bends of the visibility graph. From a
viewpoint everything in sight is as far as the eye says; what lies in the shadow of an obstacle is
reached over a bend that the viewpoint sees. Shadows of convex shapes are convex, so they are
filled like any other polygon instead of being tested cell by cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pushplan.geometry.grid import Grid, nearest_marked, occupancy
from pushplan.geometry.obstacles import grown_map
from pushplan.world import StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen

MAX_VALUES = 2**23
"""A table of distances has at most so many entries; larger maps get coarser cells."""

Table = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class BendDistances:
    """Distances of every cell of a map to every bend around its obstacles."""

    static: StaticMap  # the map
    grid: Grid  # place of the cells
    # (rows, columns, B) length [m] of the shortest way that goes on past the bend; inf where no way
    # leads. Cells inside an obstacle have the value of the nearest free one.
    table: Table
    loops: FloatArray  # (V, 2) corners of convex polygons just around the obstacles [m], flattened
    offsets: IntArray  # (P + 1,) where each polygon starts

    def in_sight(self, x: float, y: float) -> tuple[IntArray, FloatArray]:
        """Bends over which a shortest path from a point [m] may lead, and how far each is [m]."""
        return grown_map(self.static).bends_in_sight(x, y)


@lru_cache(maxsize=4)
def bend_distances(
    static: StaticMap,  # obstacles and bounds
    resolution: float,  # side of a cell [m]; more where the table would pass `MAX_VALUES`
) -> BendDistances:
    """The distances of a map, kept for the maps used last."""
    bare = grown_map(static)
    count = bare.bend_count
    width, height = (static.bounds[2:] - static.bounds[:2]).tolist()
    coarsest = math.sqrt(width * height * max(1, count) / MAX_VALUES)
    grid = Grid.cover(static.bounds, max(resolution, 1.01 * coarsest))
    table = np.empty((*grid.shape, count), dtype=np.float32)
    bare.fill_bend_distances(table, grid.origin, grid.resolution)
    if count:
        blocked = occupancy(static, grid, 2.0 * bare.standoff)
        if blocked.any() and not blocked.all():
            _, rows, cols = nearest_marked(~blocked)
            table[blocked] = table[rows[blocked], cols[blocked]]
    return BendDistances(static, grid, frozen(table), *bare.outlines)
