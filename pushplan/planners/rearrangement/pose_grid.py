"""A lattice of poses over the floor, and which of them and of the moves between are free.

Sixteen headings whose straight moves lead from cell to cell; the robot drives ahead or back along
its heading, or turns to the next heading on the spot.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.collision import (
    Footprint,
    Obstacles,
    footprint,
    is_free,
    obstacles,
)
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import BoolArray, FloatArray, IntArray, frozen

_QUARTER = ((1, 0), (2, 1), (1, 1), (1, 2))
MOVES: IntArray = np.array(
    [*_QUARTER]
    + [(-y, x) for x, y in _QUARTER]
    + [(-x, -y) for x, y in _QUARTER]
    + [(y, -x) for x, y in _QUARTER],
    dtype=np.int64,
)
"""(16, 2) cells along x and y that a straight move along each heading covers."""
HEADINGS: FloatArray = np.arctan2(MOVES[:, 1], MOVES[:, 0])
"""(16,) the headings [rad]."""
LENGTHS: FloatArray = np.hypot(MOVES[:, 0], MOVES[:, 1])
"""(16,) length of the move along each heading [cells]."""
TURNS: FloatArray = np.abs(
    np.arctan2(
        np.sin(np.roll(HEADINGS, -1) - HEADINGS),
        np.cos(np.roll(HEADINGS, -1) - HEADINGS),
    )
)
"""(16,) angle from each heading to the next [rad]."""
COUNT = len(MOVES)


class Floor(NamedTuple):
    """The lattice over one static map; cell (i, j) has its middle at origin + (j, i) * step."""

    x: float
    y: float
    step: float
    blocked: BoolArray
    """(16, rows, columns) where something static is in the way."""
    barred: BoolArray
    """(2, 16, rows, columns) from where it is in the way of the move ahead, and of the turn to the
    next heading."""


@kernel(allocates=True)
def _block(
    blocked: BoolArray,
    x: float,
    y: float,
    step: float,
    headings: FloatArray,
    shape: Footprint,
    among: Obstacles,
) -> None:
    pose, scratch = np.empty(3), np.empty_like(shape.vertices)
    for t in range(blocked.shape[0]):
        pose[2] = headings[t]
        for i in range(blocked.shape[1]):
            pose[1] = y + i * step
            for j in range(blocked.shape[2]):
                pose[0] = x + j * step
                blocked[t, i, j] = not is_free(pose, shape, among, scratch)


@kernel(allocates=True)
def _bar(
    barred: BoolArray,
    blocked: BoolArray,
    x: float,
    y: float,
    step: float,
    shape: Footprint,
    among: Obstacles,
    moves: IntArray,
    turns: FloatArray,
    headings: FloatArray,
) -> None:
    """Look at a few poses between those of the lattice."""
    pose, scratch = np.empty(3), np.empty_like(shape.vertices)
    count, rows, cols = blocked.shape
    for t in range(count):
        dx, dy = moves[t, 0], moves[t, 1]
        other = t + 1 if t + 1 < count else 0
        between = math.ceil(2.0 * math.hypot(dx, dy))
        for i in range(rows):
            for j in range(cols):
                if blocked[t, i, j]:
                    continue
                if 0 <= i + dy < rows and 0 <= j + dx < cols and not blocked[t, i + dy, j + dx]:
                    pose[2] = headings[t]
                    for n in range(1, between):
                        pose[0] = x + (j + dx * n / between) * step
                        pose[1] = y + (i + dy * n / between) * step
                        if not is_free(pose, shape, among, scratch):
                            barred[0, t, i, j] = True
                            break
                if not blocked[other, i, j]:
                    pose[0], pose[1] = x + j * step, y + i * step
                    for n in range(1, 3):
                        pose[2] = headings[t] + turns[t] * n / 3.0
                        if not is_free(pose, shape, among, scratch):
                            barred[1, t, i, j] = True
                            break


@functools.lru_cache(maxsize=8)
def floor_of(robot: RobotModel, static: StaticMap, step: float, margin: float) -> Floor:
    """The lattice for a robot among what is static; kept for the maps used last.

    Args:
        robot: its footprint.
        static: walls and columns.
        step: side of a cell [m].
        margin: distance to keep from what is static [m].
    """
    x0, y0, x1, y1 = static.bounds.tolist()
    cols, rows = int((x1 - x0) / step) + 1, int((y1 - y0) / step) + 1
    blocked = np.empty((COUNT, rows, cols), dtype=np.bool_)
    x, y = (
        x0 + 0.5 * ((x1 - x0) - (cols - 1) * step),
        y0 + 0.5 * ((y1 - y0) - (rows - 1) * step),
    )
    shape, among = footprint(robot, margin), obstacles(static)
    _block(blocked, x, y, step, HEADINGS, shape, among)
    barred = np.zeros((2, COUNT, rows, cols), dtype=np.bool_)
    _bar(barred, blocked, x, y, step, shape, among, MOVES, TURNS, HEADINGS)
    return Floor(x, y, step, frozen(blocked), frozen(barred))


@kernel(allocates=True)
def near_poses(floor: Floor, pose: FloatArray, reach: float) -> tuple[IntArray, FloatArray]:
    """Free poses of the lattice near a pose: flat indices and what it costs to get there [m].

    Args:
        floor: the lattice.
        pose: (3,) x, y [m], theta [rad].
        reach: how many cells away they may be.
    """
    count, rows, cols = floor.blocked.shape
    u, v = (pose[0] - floor.x) / floor.step, (pose[1] - floor.y) / floor.step
    i0, i1 = max(0, math.ceil(v - reach)), min(rows - 1, math.floor(v + reach))
    j0, j1 = max(0, math.ceil(u - reach)), min(cols - 1, math.floor(u + reach))
    most = count * max(0, i1 - i0 + 1) * max(0, j1 - j0 + 1)
    found, costs, n = np.empty(most, dtype=np.int64), np.empty(most), 0
    for t in range(count):
        turn = abs((HEADINGS[t] - pose[2] + math.pi) % (2.0 * math.pi) - math.pi)
        if turn >= 0.5:
            continue
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                away = math.hypot(i - v, j - u)
                if away <= reach and not floor.blocked[t, i, j]:
                    found[n] = (t * rows + i) * cols + j
                    costs[n] = (away + 0.5 * turn) * floor.step
                    n += 1
    return found[:n], costs[:n]


def pose_at(floor: Floor, node: int) -> FloatArray:
    """(3,) the pose of a flat index."""
    _, rows, cols = floor.blocked.shape
    t, rest = divmod(node, rows * cols)
    i, j = divmod(rest, cols)
    return np.array([floor.x + j * floor.step, floor.y + i * floor.step, HEADINGS[t]])
