"""Compiled lattice of poses, and which of them and of the moves between are free.

Sixteen headings whose straight moves lead from cell to cell; the robot drives ahead or back along
its heading, or turns to the next heading on the spot.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.compiled import kernel
from pushplan.geometry import convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.kernels import Bodies
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_QUARTER = ((1, 0), (2, 1), (1, 1), (1, 2))
MOVES: IntArray = np.array(
    [*_QUARTER]
    + [(-y, x) for x, y in _QUARTER]
    + [(-x, -y) for x, y in _QUARTER]
    + [(y, -x) for x, y in _QUARTER],
    dtype=np.int64,
)
"""(16, 2) cells along x and y that a straight move along each heading crosses."""
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
Layers = NDArray[np.float32]
"""(K, 16, rows, columns) depth of the footprint in each object [m]."""


class PoseGrid(NamedTuple):
    """The lattice over one static map; cell (i, j) has its middle at (x, y) + (j, i) * step."""

    x: float
    y: float
    step: float
    blocked: BoolArray  # (16, rows, columns) where something static is in the way
    blocked_moves: BoolArray
    """(2, 16, rows, columns) from where it is in the way of the move ahead, and of the turn to the
    next heading."""


@kernel(allocates=True)
def block_poses(grid: PoseGrid, shape: Footprint, among: ConvexObstacles) -> None:
    """Mark the poses at which the footprint touches an obstacle."""
    pose = np.empty(3)
    scratch = np.empty_like(shape.vertices)
    count, rows, cols = grid.blocked.shape
    for t in range(count):
        pose[2] = HEADINGS[t]
        for i in range(rows):
            pose[1] = grid.y + i * grid.step
            for j in range(cols):
                pose[0] = grid.x + j * grid.step
                grid.blocked[t, i, j] = not is_free(pose, shape, among, scratch)


@kernel(allocates=True)
def block_moves(grid: PoseGrid, shape: Footprint, among: ConvexObstacles) -> None:
    """Mark the moves between free poses on which the footprint touches an obstacle."""
    pose = np.empty(3)
    scratch = np.empty_like(shape.vertices)
    blocked = grid.blocked
    step = grid.step
    count, rows, cols = blocked.shape
    for t in range(count):
        dx = MOVES[t, 0]
        dy = MOVES[t, 1]
        other = t + 1 if t + 1 < count else 0
        between = math.ceil(2.0 * math.hypot(dx, dy))
        for i in range(rows):
            for j in range(cols):
                if blocked[t, i, j]:
                    continue
                if 0 <= i + dy < rows and 0 <= j + dx < cols and not blocked[t, i + dy, j + dx]:
                    pose[2] = HEADINGS[t]
                    for n in range(1, between):
                        pose[0] = grid.x + (j + dx * n / between) * step
                        pose[1] = grid.y + (i + dy * n / between) * step
                        if not is_free(pose, shape, among, scratch):
                            grid.blocked_moves[0, t, i, j] = True
                            break
                if not blocked[other, i, j]:
                    pose[0] = grid.x + j * step
                    pose[1] = grid.y + i * step
                    for n in range(1, 3):
                        pose[2] = HEADINGS[t] + TURNS[t] * n / 3.0
                        if not is_free(pose, shape, among, scratch):
                            grid.blocked_moves[1, t, i, j] = True
                            break


@kernel(allocates=True)
def near_poses(grid: PoseGrid, pose: FloatArray, reach: float) -> tuple[IntArray, FloatArray]:
    """Flat indices of free poses within ``reach`` cells of a pose (3,), and the cost there [m]."""
    count, rows, cols = grid.blocked.shape
    u = (pose[0] - grid.x) / grid.step
    v = (pose[1] - grid.y) / grid.step
    i0 = max(0, math.ceil(v - reach))
    i1 = min(rows - 1, math.floor(v + reach))
    j0 = max(0, math.ceil(u - reach))
    j1 = min(cols - 1, math.floor(u + reach))
    most = count * max(0, i1 - i0 + 1) * max(0, j1 - j0 + 1)
    found = np.empty(most, dtype=np.int64)
    costs = np.empty(most)
    n = 0
    for t in range(count):
        turn = abs((HEADINGS[t] - pose[2] + math.pi) % (2.0 * math.pi) - math.pi)
        if turn >= 0.5:
            continue
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                away = math.hypot(i - v, j - u)
                if away <= reach and not grid.blocked[t, i, j]:
                    found[n] = (t * rows + i) * cols + j
                    costs[n] = (away + 0.5 * turn) * grid.step
                    n += 1
    return found[:n], costs[:n]


@kernel(allocates=True)
def contact_depths(grid: PoseGrid, shape: Footprint, poses: FloatArray, bodies: Bodies) -> Layers:
    """(K, 16, rows, columns) how deep the footprint is in each of the objects [m]."""
    count, rows, cols = grid.blocked.shape
    out = np.zeros((poses.shape[0], count, rows, cols), dtype=np.float32)
    outline = np.empty_like(bodies.vertices)
    moved = np.empty_like(bodies.vertices)
    pose = np.zeros(3)
    body = np.empty_like(shape.vertices)
    for k in range(poses.shape[0]):
        a = bodies.offsets[k]
        b = bodies.offsets[k + 1]
        transform_points(poses[k], bodies.vertices[a:b], outline[a:b])
        reach = shape.radius + bodies.radii[k]
        i0 = max(0, math.ceil((poses[k, 1] - reach - grid.y) / grid.step))
        i1 = min(rows - 1, math.floor((poses[k, 1] + reach - grid.y) / grid.step))
        j0 = max(0, math.ceil((poses[k, 0] - reach - grid.x) / grid.step))
        j1 = min(cols - 1, math.floor((poses[k, 0] + reach - grid.x) / grid.step))
        for t in range(count):
            pose[2] = HEADINGS[t]
            transform_points(pose, shape.vertices, body)
            for i in range(i0, i1 + 1):
                y = grid.y + i * grid.step
                for j in range(j0, j1 + 1):
                    x = grid.x + j * grid.step
                    dx = poses[k, 0] - x
                    dy = poses[k, 1] - y
                    if dx * dx + dy * dy >= reach * reach or grid.blocked[t, i, j]:
                        continue
                    deepest = 0.0
                    for n in range(a, b):
                        moved[n, 0] = outline[n, 0] - x
                        moved[n, 1] = outline[n, 1] - y
                    for p in range(shape.offsets.shape[0] - 1):
                        part = body[shape.offsets[p] : shape.offsets[p + 1]]
                        deepest = max(deepest, convex_penetration(part, moved[a:b])[0])
                    out[k, t, i, j] = deepest
    return out


@kernel(allocates=True)
def add_layers(layers: Layers, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Depth in all objects of weight at each pose [m], and the weights (K,) of those it is in."""
    count, turns, rows, cols = layers.shape
    flat = layers.reshape((count, turns * rows * cols))
    depths = np.zeros(flat.shape[1])
    touch = np.zeros(flat.shape[1])
    for k in range(count):
        if weights[k] == 0.0:
            continue
        for n in range(flat.shape[1]):
            if flat[k, n] > 0.0:
                depths[n] += flat[k, n]
                touch[n] += weights[k]
    return depths.reshape((turns, rows, cols)), touch.reshape((turns, rows, cols))
