"""The lattice of poses for a robot on a static map."""

from __future__ import annotations

import functools

import numpy as np

from pushplan.motion.collision import footprint, obstacles
from pushplan.planners.rearrangement.pose_grid_kernels import (
    HEADINGS,
    PoseGrid,
    block_moves,
    block_poses,
)
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import FloatArray, frozen


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
    cols, rows = int((x1 - x0) / step) + 1, int((y1 - y0) / step) + 1
    grid = PoseGrid(
        x0 + 0.5 * ((x1 - x0) - (cols - 1) * step),
        y0 + 0.5 * ((y1 - y0) - (rows - 1) * step),
        step,
        np.empty((len(HEADINGS), rows, cols), dtype=np.bool_),
        np.zeros((2, len(HEADINGS), rows, cols), dtype=np.bool_),
    )
    shape, among = footprint(robot, margin), obstacles(static)
    block_poses(grid, shape, among)
    block_moves(grid, shape, among)
    return grid._replace(blocked=frozen(grid.blocked), blocked_moves=frozen(grid.blocked_moves))


def pose_at(grid: PoseGrid, node: int) -> FloatArray:
    """(3,) the pose of a flat index."""
    _, rows, cols = grid.blocked.shape
    t, rest = divmod(node, rows * cols)
    i, j = divmod(rest, cols)
    return np.array([grid.x + j * grid.step, grid.y + i * grid.step, HEADINGS[t]])
