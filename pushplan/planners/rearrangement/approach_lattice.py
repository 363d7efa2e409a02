"""The lattice of robot poses on which approaches are searched, with the objects on it."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.core import interaction
from pushplan.core import rearrangement as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import FloatArray

_LEAST_CELL = 0.012
"""Side of a cell that is not too small for the map, as a fraction of its longer side."""


class ContactGrid(NamedTuple):
    """A lattice with the objects on it."""

    grid: core.PoseGrid
    layers: NDArray[np.float32]  # (K, 16, rows, columns) depth of the footprint in each object [m]


def contact_grid(
    robot: RobotModel,
    static: StaticMap,
    cell: float,
    margin: float,
    poses: FloatArray,
    bodies: interaction.Bodies,
    part: float = 1.0,
) -> ContactGrid:
    """The lattice for a robot among what is static and objects.

    Args:
        robot: its footprint.
        static: walls and columns.
        cell: side of a cell that is not too small for the map [circumscribed radii].
        margin: distance to keep from what is static [circumscribed radii].
        poses: (K, 3) of the objects.
        bodies: their shapes.
        part: of such a cell, for a finer lattice.
    """
    size = robot.circumscribed_radius
    away = margin * size
    sides = static.bounds[2:] - static.bounds[:2]
    side = max(cell, _LEAST_CELL * float(sides.max()) / size) * size
    grid = make_pose_grid(robot, static, part * side, away)
    return ContactGrid(grid, grid.contact_depths(footprint(robot, away), poses, bodies))


@functools.lru_cache(maxsize=8)
def make_pose_grid(
    robot: RobotModel, static: StaticMap, step: float, margin: float
) -> core.PoseGrid:
    """The lattice for a robot among what is static; kept for the maps used last.

    Args:
        robot: its footprint.
        static: walls and columns.
        step: side of a cell [m].
        margin: distance to keep from what is static [m].
    """
    x0, y0, x1, y1 = static.bounds.tolist()
    cols = int((x1 - x0) / step) + 1
    rows = int((y1 - y0) / step) + 1
    return core.PoseGrid(
        x0 + 0.5 * ((x1 - x0) - (cols - 1) * step),
        y0 + 0.5 * ((y1 - y0) - (rows - 1) * step),
        step,
        rows,
        cols,
        footprint(robot, margin),
        obstacles(static),
    )
