"""Compiled steps of the ice generator: placing discs, cutting cells, fitting floes into them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry import polygon_area
from pushplan.world.checks import FloatArray, IntArray


class IceWater(NamedTuple):
    """A rectangle of water with regions to stay off."""

    box: FloatArray  # (4,) x_min, y_min, x_max, y_max [m]; floes stay inside
    blocks: FloatArray  # (V, 2) corners of the convex regions [m], counter-clockwise, flattened
    block_offsets: IntArray  # (B + 1,) where each region starts
    gap: float  # Least distance between floes, and from floes to regions [m]


@kernel
def nearest_point(x: float, y: float, polygon: FloatArray) -> tuple[float, float, float]:
    """Distance [m] of a point to a convex polygon and its nearest point; 0 and itself inside."""
    best = math.inf
    bx = x
    by = y
    inside = True
    n = polygon.shape[0]
    for a in range(n):
        b = a + 1 if a + 1 < n else 0
        ex = polygon[b, 0] - polygon[a, 0]
        ey = polygon[b, 1] - polygon[a, 1]
        px = x - polygon[a, 0]
        py = y - polygon[a, 1]
        if ex * py - ey * px < 0.0:
            inside = False
        t = min(1.0, max(0.0, (ex * px + ey * py) / (ex * ex + ey * ey)))
        qx = polygon[a, 0] + t * ex
        qy = polygon[a, 1] + t * ey
        d = math.hypot(x - qx, y - qy)
        if d < best:
            best = d
            bx = qx
            by = qy
    if inside:
        return 0.0, x, y
    return best, bx, by


CAPACITY = 48
"""Corners that a buffer holds; a floe has far fewer."""


class Discs(NamedTuple):
    """Discs that a power diagram is of, and which of them may be neighbours."""

    centres: FloatArray  # (K, 2) [m]
    radii: FloatArray  # (K,) [m]; a disc that overlaps no other lies in its own cell
    reaches: FloatArray  # (K,) half side of the square that a cell cannot leave [m]
    neighbours: IntArray
    """Discs whose squares may meet, those of one disc after those of the one before."""
    neighbour_offsets: IntArray  # (K + 1,) where those of each disc start


class Outlines(NamedTuple):
    """Convex outlines, counter-clockwise, in buffers of equal length."""

    corners: FloatArray  # (K, N, 2)
    counts: IntArray  # (K,) corners in use


@kernel(allocates=True)
def cut_cells(discs: Discs, water: IceWater) -> Outlines:
    """Cells of a power diagram (Laguerre tessellation), half a gap smaller on every side [m]."""
    box = water.box
    centres = discs.centres
    radii = discs.radii
    count = centres.shape[0]
    cells = Outlines(np.empty((count, CAPACITY, 2)), np.zeros(count, np.int64))
    spare = np.empty((CAPACITY, 2))
    for k in range(count):
        x = centres[k, 0]
        y = centres[k, 1]
        r = discs.reaches[k]
        cell = cells.corners[k]
        x0 = max(box[0], x - r)
        y0 = max(box[1], y - r)
        x1 = min(box[2], x + r)
        y1 = min(box[3], y + r)
        cell[0, 0] = x0
        cell[0, 1] = y0
        cell[1, 0] = x1
        cell[1, 1] = y0
        cell[2, 0] = x1
        cell[2, 1] = y1
        cell[3, 0] = x0
        cell[3, 1] = y1
        n = 4
        for q in range(discs.neighbour_offsets[k], discs.neighbour_offsets[k + 1]):
            other = discs.neighbours[q]
            dx = centres[other, 0] - x
            dy = centres[other, 1] - y
            far = math.hypot(dx, dy)
            away = 0.5 * (far + (radii[k] ** 2 - radii[other] ** 2) / far - water.gap)
            ux = dx / far
            uy = dy / far
            n = _clip(cell, n, ux, uy, ux * x + uy * y + away, spare)
        for b in range(water.block_offsets.shape[0] - 1):
            block = water.blocks[water.block_offsets[b] : water.block_offsets[b + 1]]
            far, bx, by = nearest_point(x, y, block)
            if far == 0.0:
                n = 0
                break
            ux = (bx - x) / far
            uy = (by - y) / far
            n = _clip(cell, n, ux, uy, ux * bx + uy * by - water.gap, spare)
        cells.counts[k] = n
    return cells


@kernel
def _clip(
    corners: FloatArray, n: int, ux: float, uy: float, bound: float, spare: FloatArray
) -> int:
    """Cut a convex polygon by the half-plane u · p <= bound, in place; its number of corners."""
    cuts = False
    for i in range(n):
        if ux * corners[i, 0] + uy * corners[i, 1] > bound:
            cuts = True
            break
    if not cuts:
        return n
    m = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        a = ux * corners[i, 0] + uy * corners[i, 1] - bound
        b = ux * corners[j, 0] + uy * corners[j, 1] - bound
        if a <= 0.0 and m < spare.shape[0]:
            spare[m, 0] = corners[i, 0]
            spare[m, 1] = corners[i, 1]
            m += 1
        if (a < 0.0 < b or b < 0.0 < a) and m < spare.shape[0]:
            t = a / (a - b)
            spare[m, 0] = corners[i, 0] + t * (corners[j, 0] - corners[i, 0])
            spare[m, 1] = corners[i, 1] + t * (corners[j, 1] - corners[i, 1])
            m += 1
    copy_into(corners[:m], spare[:m])
    return int(m) if m > 2 else 0


@kernel
def _cut_out(
    shape: FloatArray,  # (N, 2) about the origin
    scale: float,
    centre: FloatArray,  # (2,) [m]
    cell: FloatArray,  # (M, 2) convex [m]
    out: FloatArray,
    spare: FloatArray,
) -> int:
    """A scaled shape about a place within a convex cell; its number of corners."""
    n: int = shape.shape[0]
    for i in range(n):
        out[i, 0] = centre[0] + scale * shape[i, 0]
        out[i, 1] = centre[1] + scale * shape[i, 1]
    for i in range(cell.shape[0]):
        j = i + 1 if i + 1 < cell.shape[0] else 0
        ux = cell[j, 1] - cell[i, 1]
        uy = cell[i, 0] - cell[j, 0]
        long = math.hypot(ux, uy)
        if long == 0.0:
            continue
        ux = ux / long
        uy = uy / long
        n = _clip(out, n, ux, uy, ux * cell[i, 0] + uy * cell[i, 1], spare)
    return n


@kernel(allocates=True)
def fit_floes(
    shapes: Outlines,  # of area 1 about the origin
    centres: FloatArray,  # (K, 2) [m]
    cells: Outlines,  # from `cut_cells` [m]
    targets: FloatArray,  # (K,) areas [m²]
    stretch: float,  # greatest scale of a shape, in units of the root of its target area
) -> Outlines:
    """Grow each shape within its cell until it has its area, or cannot grow further [m]."""
    count = centres.shape[0]
    floes = Outlines(np.empty((count, CAPACITY, 2)), np.zeros(count, np.int64))
    spare = np.empty((CAPACITY, 2))
    for k in range(count):
        if cells.counts[k] == 0:
            continue
        at = centres[k]
        shape = shapes.corners[k, : shapes.counts[k]]
        cell = cells.corners[k, : cells.counts[k]]
        floe = floes.corners[k]
        unit = math.sqrt(targets[k])
        low = unit
        high = unit
        n = _cut_out(shape, unit, at, cell, floe, spare)
        if n == 0 or polygon_area(floe[:n]) < targets[k]:
            high = stretch * unit
        for _ in range(24 if high > low else 0):
            middle = 0.5 * (low + high)
            n = _cut_out(shape, middle, at, cell, floe, spare)
            if n > 0 and polygon_area(floe[:n]) >= targets[k]:
                high = middle
            else:
                low = middle
        n = _cut_out(shape, high, at, cell, floe, spare)
        floes.counts[k] = _simplify(floe, n, 0.08 * unit)
    return floes


@kernel
def _simplify(corners: FloatArray, n: int, shortest: float) -> int:
    """Leave out corners, in place, while an edge is shorter than ``shortest`` [m]; their number."""
    while n > 3:
        best = shortest
        at = -1
        for i in range(n):
            j = i + 1 if i + 1 < n else 0
            d = math.hypot(corners[j, 0] - corners[i, 0], corners[j, 1] - corners[i, 1])
            if d < best:
                best = d
                at = i
        if at < 0:
            break
        # of its two ends the one whose loss costs the smaller triangle
        after = at + 1 if at + 1 < n else 0
        if _loss(corners, n, after) < _loss(corners, n, at):
            at = after
        for i in range(at, n - 1):
            corners[i, 0] = corners[i + 1, 0]
            corners[i, 1] = corners[i + 1, 1]
        n -= 1
    return n


@kernel
def _loss(corners: FloatArray, n: int, i: int) -> float:
    """Area [m²] that a polygon loses with corner ``i``."""
    a = (i - 1) % n
    b = (i + 1) % n
    ux = corners[i, 0] - corners[a, 0]
    uy = corners[i, 1] - corners[a, 1]
    vx = corners[b, 0] - corners[a, 0]
    vy = corners[b, 1] - corners[a, 1]
    return float(0.5 * abs(ux * vy - uy * vx))


class _Buckets(NamedTuple):
    """Placed discs in the cells of a grid."""

    head: IntArray  # (R, C) last disc in each cell, -1 for none
    following: IntArray  # (K,) the one before it in the same cell
    centres: FloatArray  # (K, 2) [m]
    radii: FloatArray  # (K,) [m]


@kernel(allocates=True)
def place_discs(
    radii: FloatArray,  # (K,) [m], largest first
    draws: FloatArray,  # (K, T, 3) uniform in [0, 1): place, and whether it is taken
    density: FloatArray,  # (R, C) chance that a place is taken, 0 to 1, over the box
    water: IceWater,
) -> FloatArray:
    """(J, 2) centres [m] of the first J discs, which found a place; K - J did not."""
    box = water.box
    count = draws.shape[0]
    tries = draws.shape[1]
    width = box[2] - box[0]
    height = box[3] - box[1]
    rows, cols = density.shape
    side = 2.0 * radii[0] + water.gap
    nx = max(1, int(width / side))
    ny = max(1, int(height / side))
    buckets = _Buckets(
        np.full((ny, nx), -1, np.int64), np.full(count, -1, np.int64), np.empty((count, 2)), radii
    )
    for k in range(count):
        r = radii[k]
        done = False
        for t in range(tries):
            u = draws[k, t, 0]
            v = draws[k, t, 1]
            x = box[0] + r + u * max(0.0, width - 2.0 * r)
            y = box[1] + r + v * max(0.0, height - 2.0 * r)
            chance = density[
                min(rows - 1, int((y - box[1]) / height * rows)),
                min(cols - 1, int((x - box[0]) / width * cols)),
            ]
            # the second half of the draws of a disc takes any place
            if 2 * t < tries and draws[k, t, 2] > chance:
                continue
            i = min(nx - 1, int((x - box[0]) / width * nx))
            j = min(ny - 1, int((y - box[1]) / height * ny))
            reach = r + water.gap
            if _touches_disc(x, y, reach, i, j, buckets) or _touches_block(x, y, reach, water):
                continue
            buckets.centres[k, 0] = x
            buckets.centres[k, 1] = y
            buckets.following[k] = buckets.head[j, i]
            buckets.head[j, i] = k
            done = True
            break
        if not done:
            return buckets.centres[:k]
    return buckets.centres


@kernel
def _touches_disc(x: float, y: float, reach: float, i: int, j: int, buckets: _Buckets) -> bool:
    """Return True if a disc of radius ``reach`` in column i and row j overlaps a placed one."""
    head = buckets.head
    centres = buckets.centres
    for row in range(max(0, j - 1), min(head.shape[0], j + 2)):
        for col in range(max(0, i - 1), min(head.shape[1], i + 2)):
            q = head[row, col]
            while q >= 0:
                dx = centres[q, 0] - x
                dy = centres[q, 1] - y
                far = reach + buckets.radii[q]
                if dx * dx + dy * dy < far * far:
                    return True
                q = buckets.following[q]
    return False


@kernel
def _touches_block(x: float, y: float, reach: float, water: IceWater) -> bool:
    """Return True if a disc of radius ``reach`` overlaps a region to stay off."""
    offsets = water.block_offsets
    for b in range(offsets.shape[0] - 1):
        gap, _, _ = nearest_point(x, y, water.blocks[offsets[b] : offsets[b + 1]])
        if gap < reach:
            return True
    return False
