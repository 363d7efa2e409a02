"""The lattice of robot poses on which approaches are searched, with the objects on it."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from pushplan.interaction.kernels import Bodies
from pushplan.motion.collision import footprint_arrays, obstacle_arrays
from pushplan.planners.rearrangement.pose_grid_kernels import (
    HEADINGS,
    Layers,
    PoseGrid,
    block_moves,
    block_poses,
    contact_depths,
)
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import FloatArray, frozen

_LEAST_CELL = 0.012
"""Side of a cell that is not too small for the map, as a fraction of its longer side."""


class ContactGrid(NamedTuple):
    """A lattice with the objects on it."""

    grid: PoseGrid
    layers: Layers


def contact_grid(
    robot: RobotModel,
    static: StaticMap,
    cell: float,
    margin: float,
    poses: FloatArray,
    bodies: Bodies,
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
    return ContactGrid(grid, contact_depths(grid, footprint_arrays(robot, away), poses, bodies))


@functools.lru_cache(maxsize=8)
def make_pose_grid(robot: RobotModel, static: StaticMap, step: float, margin: float) -> PoseGrid:
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
    grid = PoseGrid(
        x0 + 0.5 * ((x1 - x0) - (cols - 1) * step),
        y0 + 0.5 * ((y1 - y0) - (rows - 1) * step),
        step,
        np.empty((len(HEADINGS), rows, cols), dtype=np.bool_),
        np.zeros((2, len(HEADINGS), rows, cols), dtype=np.bool_),
    )
    shape = footprint_arrays(robot, margin)
    among = obstacle_arrays(static)
    block_poses(grid, shape, among)
    block_moves(grid, shape, among)
    return grid._replace(blocked=frozen(grid.blocked), blocked_moves=frozen(grid.blocked_moves))
