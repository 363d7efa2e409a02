"""Compiled tests between two convex polygons: penetration, overlap, distance."""

from __future__ import annotations

import math

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray


@kernel
def _best_edge(a: FloatArray, b: FloatArray) -> tuple[float, float, float]:
    """Outward edge normal of ``a`` along which ``b`` is farthest away: gap [m] and normal."""
    best = -math.inf
    bx = 1.0
    by = 0.0
    n = a.shape[0]
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        nx = a[j, 1] - a[i, 1]
        ny = a[i, 0] - a[j, 0]
        length = math.sqrt(nx * nx + ny * ny)
        if length == 0.0:
            continue
        nx /= length
        ny /= length
        gap = math.inf
        for k in range(b.shape[0]):
            d = (b[k, 0] - a[i, 0]) * nx + (b[k, 1] - a[i, 1]) * ny
            gap = min(gap, d)
        if gap > best:
            best = gap
            bx = nx
            by = ny
    return best, bx, by


@kernel
def convex_penetration(a: FloatArray, b: FloatArray) -> tuple[float, float, float]:
    """Least translation that separates two convex polygons (separating axis theorem).

    Args:
        a: (N, 2) corners [m], counter-clockwise.
        b: (M, 2) corners [m], counter-clockwise.

    Returns:
        depth [m] and a unit normal (nx, ny) that points from ``a`` to ``b``. With depth > 0 they
        overlap and moving ``b`` by ``depth * n`` just separates them; with depth <= 0 they do not,
        and ``-depth`` is the widest gap along an edge normal (at most their distance).
    """
    gap_a, ax, ay = _best_edge(a, b)
    gap_b, bx, by = _best_edge(b, a)
    if gap_a >= gap_b:
        return -gap_a, ax, ay
    return -gap_b, -bx, -by


@kernel
def _is_separated_by_edge(a: FloatArray, b: FloatArray) -> bool:
    """Return True if an edge of ``a`` has all of ``b`` on its outer side."""
    n = a.shape[0]
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        nx = a[j, 1] - a[i, 1]
        ny = a[i, 0] - a[j, 0]
        if nx == 0.0 and ny == 0.0:
            continue
        outside = True
        for k in range(b.shape[0]):
            if (b[k, 0] - a[i, 0]) * nx + (b[k, 1] - a[i, 1]) * ny < 0.0:
                outside = False
                break
        if outside:
            return True
    return False


@kernel
def convex_overlap(a: FloatArray, b: FloatArray) -> bool:
    """Return True if two convex counter-clockwise polygons overlap; touching does not count."""
    return not (_is_separated_by_edge(a, b) or _is_separated_by_edge(b, a))


@kernel
def point_segment_distance_sq(
    x: float, y: float, ax: float, ay: float, bx: float, by: float
) -> float:
    """Squared distance [m²] of the point x, y to the segment a-b."""
    dx = bx - ax
    dy = by - ay
    px = x - ax
    py = y - ay
    length_sq = dx * dx + dy * dy
    t = 0.0
    if length_sq > 0.0:
        t = min(1.0, max(0.0, (px * dx + py * dy) / length_sq))
    ex = px - t * dx
    ey = py - t * dy
    return ex * ex + ey * ey


@kernel
def _least_corner_distance_sq(a: FloatArray, b: FloatArray) -> float:
    """Least squared distance [m²] of a corner of ``a`` to an edge of ``b``."""
    best = math.inf
    n = a.shape[0]
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        for k in range(b.shape[0]):
            d = point_segment_distance_sq(b[k, 0], b[k, 1], a[i, 0], a[i, 1], a[j, 0], a[j, 1])
            best = min(best, d)
    return best


@kernel
def convex_distance(a: FloatArray, b: FloatArray) -> float:
    """Distance [m] between two convex counter-clockwise polygons, 0 if they overlap."""
    if convex_overlap(a, b):
        return 0.0
    # of two disjoint polygons, the nearest points include a corner of one
    return math.sqrt(min(_least_corner_distance_sq(a, b), _least_corner_distance_sq(b, a)))
