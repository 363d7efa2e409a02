"""Contact between two convex polygons: the points where one holds the other."""

from __future__ import annotations

import numpy as np
from numba import njit

from pushplan.world.checks import FloatArray


@njit(cache=True, nogil=True)
def least_overlap(a: FloatArray, b: FloatArray) -> tuple[float, int]:
    """Greatest separation of ``b`` from the edges of ``a``, and the edge that has it.

    Args:
        a: (N, 2) counter-clockwise corners [m].
        b: (M, 2) counter-clockwise corners [m].

    Returns:
        Signed gap [m] along the edge's outward normal (negative: overlap) and the edge's index.
        Stops at the first edge that separates the two.
    """
    best, edge = -np.inf, 0
    count = a.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        nx, ny = a[j, 1] - a[i, 1], a[i, 0] - a[j, 0]
        scale = 1.0 / np.sqrt(nx * nx + ny * ny)
        nx *= scale
        ny *= scale
        gap = np.inf
        for k in range(b.shape[0]):
            d = (b[k, 0] - a[i, 0]) * nx + (b[k, 1] - a[i, 1]) * ny
            if d < gap:
                gap = d
        if gap > best:
            best, edge = gap, i
            if best > 0.0:
                break
    return best, edge


@njit(cache=True, nogil=True)
def contacts(a: FloatArray, b: FloatArray, out: FloatArray) -> int:
    """Contact points of two overlapping convex polygons, by clipping the incident edge.

    Args:
        a: (N, 2) counter-clockwise corners [m].
        b: (M, 2) counter-clockwise corners [m].
        out: (2, 5) receives for each point x, y [m], the unit normal from ``a`` to ``b``, and the
            depth [m] by which ``b`` has to move along it.

    Returns:
        The number of points: 0 where the two do not overlap, else 1 or 2.
    """
    gap_a, edge_a = least_overlap(a, b)
    if gap_a >= 0.0:
        return 0
    gap_b, edge_b = least_overlap(b, a)
    if gap_b >= 0.0:
        return 0
    # a small preference for a's edges keeps the choice from flickering on ties
    flip = gap_b > gap_a + 1e-9 + 0.01 * abs(gap_a)
    ref, inc, edge = (b, a, edge_b) if flip else (a, b, edge_a)
    count = ref.shape[0]
    p, q = ref[edge], ref[edge + 1 if edge + 1 < count else 0]
    tx, ty = q[0] - p[0], q[1] - p[1]
    length = np.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    nx, ny = ty, -tx
    # the incident edge faces the reference normal most directly
    side, facing = 0, np.inf
    total = inc.shape[0]
    for i in range(total):
        j = i + 1 if i + 1 < total else 0
        ex, ey = inc[j, 1] - inc[i, 1], inc[i, 0] - inc[j, 0]
        d = (ex * nx + ey * ny) / np.sqrt(ex * ex + ey * ey)
        if d < facing:
            facing, side = d, i
    u, w = inc[side], inc[side + 1 if side + 1 < total else 0]
    su, sw = (u[0] - p[0]) * tx + (u[1] - p[1]) * ty, (w[0] - p[0]) * tx + (w[1] - p[1]) * ty
    du, dw = (u[0] - p[0]) * nx + (u[1] - p[1]) * ny, (w[0] - p[0]) * nx + (w[1] - p[1]) * ny
    sign = -1.0 if flip else 1.0
    found = 0
    span = sw - su
    for end in range(2):
        s, d = (su, du) if end == 0 else (sw, dw)
        clipped = min(max(s, 0.0), length)
        if clipped != s:
            if abs(span) < 1e-12 * length:
                continue
            d = du + (clipped - su) / span * (dw - du)
        if d < 0.0:
            out[found, 0] = p[0] + clipped * tx + d * nx
            out[found, 1] = p[1] + clipped * ty + d * ny
            out[found, 2] = sign * nx
            out[found, 3] = sign * ny
            out[found, 4] = -d
            found += 1
    return found
