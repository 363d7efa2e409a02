"""The connected components of the free space of a disc among convex obstacles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pushplan.geometry.grid import Grid, clearance_field
from pushplan.world import Movables, NavigationGoal, StaticMap
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray, frozen


@dataclass(frozen=True, eq=False)
class FreeComponents(ArrayRecord):
    """Cells in which the centre of a disc may be, by connected component.

    Args:
        grid: where the cells are.
        clearance: (rows, columns) distance of each cell centre to the nearest obstacle [m].
        labels: (rows, columns) number of the component of each cell, 0 where the disc does not fit.
    """

    grid: Grid
    clearance: FloatArray
    labels: IntArray

    @classmethod
    def of(cls, grid: Grid, clearance: FloatArray, radius: float) -> FreeComponents:
        """The components for a disc of ``radius`` [m]; cells are connected along their sides."""
        from scipy import ndimage  # takes longer to import than all planners

        labels = ndimage.label(clearance > radius)[0].astype(np.int64)
        return cls(grid, clearance, labels)

    def at(self, point: ArrayLike) -> int:
        """The component of a point (2,) [m]; 0 where the disc does not fit, or out of bounds."""
        row, col = self.grid.cell(*(float(value) for value in np.asarray(point)[:2]))
        rows, cols = self.grid.shape
        if not (0 <= row < rows and 0 <= col < cols):
            return 0
        return int(self.labels[row, col])

    def of_goal(self, goal: NavigationGoal) -> set[int]:
        """The components that hold a part of the goal."""
        x, y = np.meshgrid(self.grid.x, self.grid.y)
        inside = self.labels[goal.contains(np.stack([x, y], axis=-1))]
        return {int(label) for label in np.unique(inside) if label}


def object_clearance(
    movables: Movables,
    k: int,
    pose: FloatArray,
    grid: Grid,
    reach: float,
    stopped: Callable[[], bool] = lambda: False,
) -> FloatArray:
    """(rows, columns) distance [m] of each cell centre to object ``k`` at a pose (3,).

    Beyond ``reach`` [m] it may be infinite. It is left undone as `clearance_field` is.
    """
    outline = movables.moved_to(
        np.concatenate([movables.poses[:k], pose[None], movables.poses[k + 1 :]])
    ).outline_world(k)
    step = grid.resolution
    rows, cols = grid.shape
    found = np.full(grid.shape, np.inf)
    low = np.floor((outline.min(axis=0) - reach - grid.origin) / step)
    high = np.ceil((outline.max(axis=0) + reach - grid.origin) / step)
    left, bottom = np.clip(low, 0, (cols, rows)).astype(np.int64).tolist()
    right, top = np.clip(high, 0, (cols, rows)).astype(np.int64).tolist()
    if left < right and bottom < top:
        corners = grid.origin + step * np.array([[left, bottom], [right, top]])
        near = Grid(corners[0], step, (top - bottom, right - left))
        shape = StaticMap.build([outline], bounds=corners.ravel())
        found[bottom:top, left:right] = clearance_field(shape, near, stopped)
    return frozen(found)
