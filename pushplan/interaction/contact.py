"""Contact between two convex polygons: the points where one holds the other."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray

BELOW_ZERO = -5e-324
"""The greatest number less than 0: points that touch do not overlap."""


@kernel
def least_overlap(a: FloatArray, b: FloatArray) -> tuple[float, int]:
    """Widest signed gap [m] of ``b`` along an edge normal of ``a``, and the corner it begins at."""
    best = -np.inf
    edge = 0
    for i in range(a.shape[0]):
        j = i + 1 if i + 1 < a.shape[0] else 0
        nx = a[j, 1] - a[i, 1]
        ny = a[i, 0] - a[j, 0]
        scale = 1.0 / np.sqrt(nx * nx + ny * ny)
        nx *= scale
        ny *= scale
        gap = np.inf
        for k in range(b.shape[0]):
            d = (b[k, 0] - a[i, 0]) * nx + (b[k, 1] - a[i, 1]) * ny
            if d < gap:
                gap = d
        if gap > best:
            best = gap
            edge = i
            if best > 0.0:
                break
    return best, edge


@kernel
def contacts(a: FloatArray, b: FloatArray, out: FloatArray) -> int:
    """Write up to two contact points x, y, normal, depth of overlapping convex polygons; count."""
    gap_a, edge_a = least_overlap(a, b)
    if gap_a >= 0.0:
        return 0
    gap_b, edge_b = least_overlap(b, a)
    if gap_b >= 0.0:
        return 0
    # a small preference for the first one's edges keeps the choice from flickering on ties
    if gap_b > gap_a + 1e-9 + 0.01 * abs(gap_a):
        found = clip_facing(b, edge_b, a, -1.0, BELOW_ZERO, True, out)
    else:
        found = clip_facing(a, edge_a, b, 1.0, BELOW_ZERO, True, out)
    for i in range(found):
        out[i, 4] = -out[i, 4]
    return int(found)


@kernel
def clip_facing(
    ref: FloatArray,
    edge: int,  # corner of ``ref`` where its edge begins
    inc: FloatArray,
    sign: float,  # factor on the edge's outward normal
    widest: float,  # gap up to which a point counts [m]
    beside: bool,  # True if a facing edge that lies beside the reference edge counts
    out: FloatArray,  # (2, 5) receives x, y [m], normal, gap [m]
) -> int:
    """Clip the edge that faces the reference edge against it; returns the number of points."""
    after = edge + 1 if edge + 1 < ref.shape[0] else 0
    px = ref[edge, 0]
    py = ref[edge, 1]
    tx = ref[after, 0] - px
    ty = ref[after, 1] - py
    length = np.sqrt(tx * tx + ty * ty)
    tx = tx / length
    ty = ty / length
    nx = ty
    ny = -tx
    side = 0
    other = 0
    facing = np.inf
    for i in range(inc.shape[0]):
        j = i + 1 if i + 1 < inc.shape[0] else 0
        ex = inc[j, 1] - inc[i, 1]
        ey = inc[i, 0] - inc[j, 0]
        d = (ex * nx + ey * ny) / np.sqrt(ex * ex + ey * ey)
        if d < facing:
            facing = d
            side = i
            other = j
    # the ends of the facing edge along the reference edge and along its normal
    ux = inc[side, 0] - px
    uy = inc[side, 1] - py
    wx = inc[other, 0] - px
    wy = inc[other, 1] - py
    su = ux * tx + uy * ty
    sw = wx * tx + wy * ty
    du = ux * nx + uy * ny
    dw = wx * nx + wy * ny
    found = 0
    span = sw - su
    for end in range(2):
        s, d = (su, du) if end == 0 else (sw, dw)
        clipped = min(max(s, 0.0), length)
        if clipped != s:
            if abs(span) < 1e-12 * length:
                continue
            fraction = (clipped - su) / span
            if not beside and (fraction < 0.0 or fraction > 1.0):
                continue
            d = du + fraction * (dw - du)
        if d <= widest:
            out[found, 0] = px + clipped * tx + d * nx
            out[found, 1] = py + clipped * ty + d * ny
            out[found, 2] = sign * nx
            out[found, 3] = sign * ny
            out[found, 4] = d
            found += 1
    return found
