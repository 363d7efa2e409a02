"""Which part of the floor a robot can get to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from pushplan.geometry import Grid, clearance_field
from pushplan.world import StaticMap
from pushplan.world.checks import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Reach:
    """The connected free space of a disc-shaped robot around one point."""

    grid: Grid  # where the cells are
    # (rows, columns) distance of each cell to the nearest place where the robot's centre can be [m]
    distances: FloatArray

    @classmethod
    def around(
        cls, static: StaticMap, point: ArrayLike, *, radius: float, resolution: float
    ) -> Reach:
        """The free space of a disc of ``radius`` [m] whose nearest part is nearest to ``point``.

        Args:
            static: obstacles; the map's bounds are where the grid ends.
            point: (2,) [m].
            radius: of the robot [m].
            resolution: side of a cell [m].
        """
        grid, labels, rows, cols = _components(static, radius, resolution)
        i, j = _cell(grid, np.asarray(point, dtype=np.float64)[None])
        wanted = labels[rows[i, j], cols[i, j]][0]
        if wanted == 0:  # the robot fits nowhere
            return cls(grid, np.full(grid.shape, np.inf))
        away = ndimage.distance_transform_edt(labels != wanted)
        return cls(grid, away * resolution)

    def within(self, points: FloatArray, distance: float) -> BoolArray:
        """Which of the points (N, 2) [m] are at most ``distance`` [m] from where the robot fits."""
        i, j = _cell(self.grid, points)
        near: BoolArray = self.distances[i, j] <= distance
        return near


@lru_cache(maxsize=8)
def _components(
    static: StaticMap, radius: float, resolution: float
) -> tuple[Grid, IntArray, IntArray, IntArray]:
    """The grid, the number of each cell's free component (0: none), the nearest free cell."""
    grid = Grid.cover(static.bounds, resolution)
    labels = ndimage.label(clearance_field(static, grid) > radius)[0].astype(np.int64)
    rows, cols = ndimage.distance_transform_edt(
        labels == 0, return_distances=False, return_indices=True
    )
    return grid, labels, rows, cols


def _cell(grid: Grid, points: FloatArray) -> tuple[IntArray, IntArray]:
    index = np.floor((points - grid.origin) / grid.resolution).astype(np.int64)
    return (
        np.clip(index[:, 1], 0, grid.shape[0] - 1),
        np.clip(index[:, 0], 0, grid.shape[1] - 1),
    )
