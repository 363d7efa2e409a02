"""Compiled steps of the ice generator: throwing discs, cutting cells, fitting floes into them."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry import polygon_area
from pushplan.world.checks import FloatArray, IntArray

ROOM = 48
"""Corners that a buffer holds; a floe has far fewer."""


@kernel(allocates=True)
def throw_discs(
    radii: FloatArray,
    throws: FloatArray,
    box: FloatArray,
    favour: FloatArray,
    blocks: FloatArray,
    block_offsets: IntArray,
    gap: float,
) -> FloatArray:
    """Put discs at random places, one after the other, where they touch nothing.

    Args:
        radii: (K,) [m], largest first.
        throws: (K, T, 3) uniform random numbers in [0, 1): place and whether it pleases.
        box: (4,) x_min, y_min, x_max, y_max [m]; discs stay inside.
        favour: (R, C) how much a place is liked, 0 to 1, over the box. The second half of the
            throws of a disc does not ask for it.
        blocks: (V, 2) corners of convex regions to stay off [m], counter-clockwise.
        block_offsets: (B + 1,) where each region starts.
        gap: least distance to anything [m].

    Returns:
        (J, 2) centres [m] of the first J discs, which found a place; K - J did not.
    """
    count, tries = throws.shape[0], throws.shape[1]
    width, height = box[2] - box[0], box[3] - box[1]
    rows, cols = favour.shape
    side = 2.0 * radii[0] + gap
    nx, ny = max(1, int(width / side)), max(1, int(height / side))
    head = np.full((ny, nx), -1, np.int64)
    following = np.full(count, -1, np.int64)
    centres = np.empty((count, 2))
    for k in range(count):
        r = radii[k]
        done = False
        for t in range(tries):
            u, v = throws[k, t, 0], throws[k, t, 1]
            x = box[0] + r + u * max(0.0, width - 2.0 * r)
            y = box[1] + r + v * max(0.0, height - 2.0 * r)
            liked = favour[
                min(rows - 1, int((y - box[1]) / height * rows)),
                min(cols - 1, int((x - box[0]) / width * cols)),
            ]
            if 2 * t < tries and throws[k, t, 2] > liked:
                continue
            i = min(nx - 1, int((x - box[0]) / width * nx))
            j = min(ny - 1, int((y - box[1]) / height * ny))
            if _is_taken(x, y, r + gap, i, j, head, following, centres, radii) or _is_blocked(
                x, y, r + gap, blocks, block_offsets
            ):
                continue
            centres[k, 0], centres[k, 1] = x, y
            following[k] = head[j, i]
            head[j, i] = k
            done = True
            break
        if not done:
            return centres[:k]
    return centres


@kernel(allocates=True)
def _is_taken(
    x: float,
    y: float,
    reach: float,
    i: int,
    j: int,
    head: IntArray,
    following: IntArray,
    centres: FloatArray,
    radii: FloatArray,
) -> bool:
    for row in range(max(0, j - 1), min(head.shape[0], j + 2)):
        for col in range(max(0, i - 1), min(head.shape[1], i + 2)):
            q = head[row, col]
            while q >= 0:
                dx, dy, far = centres[q, 0] - x, centres[q, 1] - y, reach + radii[q]
                if dx * dx + dy * dy < far * far:
                    return True
                q = following[q]
    return False


@kernel(allocates=True)
def _is_blocked(x: float, y: float, reach: float, blocks: FloatArray, offsets: IntArray) -> bool:
    for b in range(offsets.shape[0] - 1):
        gap, _, _ = _nearest(x, y, blocks[offsets[b] : offsets[b + 1]])
        if gap < reach:
            return True
    return False


@kernel(allocates=True)
def _nearest(x: float, y: float, polygon: FloatArray) -> tuple[float, float, float]:
    """Distance [m] of a point to a convex polygon and its nearest point; 0 and itself inside."""
    best, bx, by = math.inf, x, y
    inside = True
    n = polygon.shape[0]
    for a in range(n):
        b = a + 1 if a + 1 < n else 0
        ex, ey = polygon[b, 0] - polygon[a, 0], polygon[b, 1] - polygon[a, 1]
        px, py = x - polygon[a, 0], y - polygon[a, 1]
        if ex * py - ey * px < 0.0:
            inside = False
        t = min(1.0, max(0.0, (ex * px + ey * py) / (ex * ex + ey * ey)))
        qx, qy = polygon[a, 0] + t * ex, polygon[a, 1] + t * ey
        d = math.hypot(x - qx, y - qy)
        if d < best:
            best, bx, by = d, qx, qy
    if inside:
        return 0.0, x, y
    return best, bx, by


@kernel(allocates=True)
def cut_cells(
    centres: FloatArray,
    weights: FloatArray,
    reaches: FloatArray,
    pairs: IntArray,
    pair_offsets: IntArray,
    box: FloatArray,
    blocks: FloatArray,
    block_offsets: IntArray,
    gap: float,
) -> tuple[FloatArray, IntArray]:
    """Cells of a power diagram (Laguerre tessellation), drawn in by half a gap on every side.

    Args:
        centres: (K, 2) [m].
        weights: (K,) radii of the discs that the diagram is of [m]. A disc that overlaps no
            other lies in its own cell.
        reaches: (K,) half side of the square that a cell cannot leave [m].
        pairs: neighbours whose squares may meet, one floe after the other.
        pair_offsets: (K + 1,) where those of each floe start.
        box: (4,) bounds of all cells [m].
        blocks: (V, 2) corners of convex regions to stay off [m].
        block_offsets: (B + 1,) where each region starts.
        gap: distance between cells, and of cells to regions [m].

    Returns:
        (K, ROOM, 2) corners in the world frame [m], counter-clockwise, and (K,) their numbers.
    """
    count = centres.shape[0]
    cells, sizes = np.empty((count, ROOM, 2)), np.zeros(count, np.int64)
    spare = np.empty((ROOM, 2))
    for k in range(count):
        x, y, r = centres[k, 0], centres[k, 1], reaches[k]
        cell = cells[k]
        x0, y0 = max(box[0], x - r), max(box[1], y - r)
        x1, y1 = min(box[2], x + r), min(box[3], y + r)
        cell[0, 0], cell[0, 1], cell[1, 0], cell[1, 1] = x0, y0, x1, y0
        cell[2, 0], cell[2, 1], cell[3, 0], cell[3, 1] = x1, y1, x0, y1
        n = 4
        for q in range(pair_offsets[k], pair_offsets[k + 1]):
            other = pairs[q]
            dx, dy = centres[other, 0] - x, centres[other, 1] - y
            far = math.hypot(dx, dy)
            away = 0.5 * (far + (weights[k] ** 2 - weights[other] ** 2) / far - gap)
            ux, uy = dx / far, dy / far
            n = _clip(cell, n, ux, uy, ux * x + uy * y + away, spare)
        for b in range(block_offsets.shape[0] - 1):
            block = blocks[block_offsets[b] : block_offsets[b + 1]]
            far, bx, by = _nearest(x, y, block)
            if far == 0.0:
                n = 0
                break
            ux, uy = (bx - x) / far, (by - y) / far
            n = _clip(cell, n, ux, uy, ux * bx + uy * by - gap, spare)
        sizes[k] = n
    return cells, sizes


@kernel(allocates=True)
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
            spare[m] = corners[i]
            m += 1
        if (a < 0.0 < b or b < 0.0 < a) and m < spare.shape[0]:
            t = a / (a - b)
            spare[m, 0] = corners[i, 0] + t * (corners[j, 0] - corners[i, 0])
            spare[m, 1] = corners[i, 1] + t * (corners[j, 1] - corners[i, 1])
            m += 1
    corners[:m] = spare[:m]
    return int(m) if m > 2 else 0


@kernel(allocates=True)
def _cut_out(
    shape: FloatArray,
    scale: float,
    x: float,
    y: float,
    cell: FloatArray,
    n_cell: int,
    out: FloatArray,
    spare: FloatArray,
) -> int:
    """A scaled shape about x, y [m] within a convex cell; its number of corners."""
    n: int = shape.shape[0]
    for i in range(n):
        out[i, 0], out[i, 1] = x + scale * shape[i, 0], y + scale * shape[i, 1]
    for i in range(n_cell):
        j = i + 1 if i + 1 < n_cell else 0
        ux, uy = cell[j, 1] - cell[i, 1], cell[i, 0] - cell[j, 0]
        long = math.hypot(ux, uy)
        if long == 0.0:
            continue
        ux, uy = ux / long, uy / long
        n = _clip(out, n, ux, uy, ux * cell[i, 0] + uy * cell[i, 1], spare)
    return n


@kernel(allocates=True)
def fit_floes(
    shapes: FloatArray,
    shape_sizes: IntArray,
    centres: FloatArray,
    cells: FloatArray,
    cell_sizes: IntArray,
    targets: FloatArray,
    stretch: float,
) -> tuple[FloatArray, IntArray]:
    """Grow each shape within its cell until it has the wanted area, or cannot grow further.

    Args:
        shapes: (K, N, 2) convex outlines of area 1 about the origin, counter-clockwise.
        shape_sizes: (K,) their numbers of corners.
        centres: (K, 2) [m].
        cells: (K, ROOM, 2) from `cut_cells` [m].
        cell_sizes: (K,)
        targets: (K,) areas [m²].
        stretch: greatest scale of a shape, in units of the root of its target area.

    Returns:
        (K, ROOM, 2) corners [m] and (K,) their numbers. Short edges are left out.
    """
    count = shapes.shape[0]
    floes, sizes = np.empty((count, ROOM, 2)), np.zeros(count, np.int64)
    spare = np.empty((ROOM, 2))
    for k in range(count):
        x, y, shape = centres[k, 0], centres[k, 1], shapes[k, : shape_sizes[k]]
        cell, n_cell = cells[k], cell_sizes[k]
        if n_cell == 0:
            continue
        unit = math.sqrt(targets[k])
        low, high = unit, unit
        n = _cut_out(shape, unit, x, y, cell, n_cell, floes[k], spare)
        if n == 0 or polygon_area(floes[k, :n]) < targets[k]:
            high = stretch * unit
        for _ in range(24 if high > low else 0):
            middle = 0.5 * (low + high)
            n = _cut_out(shape, middle, x, y, cell, n_cell, floes[k], spare)
            if n > 0 and polygon_area(floes[k, :n]) >= targets[k]:
                high = middle
            else:
                low = middle
        n = _cut_out(shape, high, x, y, cell, n_cell, floes[k], spare)
        sizes[k] = _simplify(floes[k], n, 0.08 * unit)
    return floes, sizes


@kernel(allocates=True)
def _simplify(corners: FloatArray, n: int, shortest: float) -> int:
    """Leave out corners, in place, while an edge is shorter than ``shortest`` [m].

    What is left of a convex polygon is convex and lies within it.
    """
    while n > 3:
        best, at = shortest, -1
        for i in range(n):
            j = i + 1 if i + 1 < n else 0
            d = math.hypot(corners[j, 0] - corners[i, 0], corners[j, 1] - corners[i, 1])
            if d < best:
                best, at = d, i
        if at < 0:
            break
        # of its two ends the one whose loss costs the smaller triangle
        after = at + 1 if at + 1 < n else 0
        if _loss(corners, n, after) < _loss(corners, n, at):
            at = after
        for i in range(at, n - 1):
            corners[i] = corners[i + 1]
        n -= 1
    return n


@kernel(allocates=True)
def _loss(corners: FloatArray, n: int, i: int) -> float:
    """Area [m²] that a polygon loses with corner ``i``."""
    a, b = (i - 1) % n, (i + 1) % n
    ux, uy = corners[i, 0] - corners[a, 0], corners[i, 1] - corners[a, 1]
    vx, vy = corners[b, 0] - corners[a, 0], corners[b, 1] - corners[a, 1]
    return float(0.5 * abs(ux * vy - uy * vx))
