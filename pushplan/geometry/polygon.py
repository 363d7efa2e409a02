"""Compiled measures of simple polygons: area, centroid, inertia."""

from __future__ import annotations

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray


@kernel
def polygon_area(v: FloatArray) -> float:
    """Shoelace area [m²] of the polygon with corners ``v`` (N, 2) [m], positive if CCW."""
    total = 0.0
    n = v.shape[0]
    # far from the origin the plain formula loses digits
    x0 = v[0, 0]
    y0 = v[0, 1]
    for i in range(1, n - 1):
        ax = v[i, 0] - x0
        ay = v[i, 1] - y0
        bx = v[i + 1, 0] - x0
        by = v[i + 1, 1] - y0
        total += ax * by - ay * bx
    return 0.5 * total


@kernel
def polygon_centroid(v: FloatArray) -> tuple[float, float]:
    """Centre of area x, y [m] of corners (N, 2); their mean where there is no area."""
    n = v.shape[0]
    x0 = v[0, 0]
    y0 = v[0, 1]
    twice = 0.0
    mx = 0.0
    my = 0.0
    sx = 0.0
    sy = 0.0
    for i in range(n):
        ax = v[i, 0] - x0
        ay = v[i, 1] - y0
        j = i + 1 if i + 1 < n else 0
        bx = v[j, 0] - x0
        by = v[j, 1] - y0
        cross = ax * by - ay * bx
        twice += cross
        mx += (ax + bx) * cross
        my += (ay + by) * cross
        sx += ax
        sy += ay
    if twice == 0.0:
        return x0 + sx / n, y0 + sy / n
    return x0 + mx / (3.0 * twice), y0 + my / (3.0 * twice)


@kernel
def polygon_inertia(v: FloatArray) -> float:
    """Second moment ∫ r² dA / A [m²] of corners (N, 2) about the centroid; 0 without area."""
    n = v.shape[0]
    cx, cy = polygon_centroid(v)
    twice = 0.0
    moment = 0.0
    for i in range(n):
        ax = v[i, 0] - cx
        ay = v[i, 1] - cy
        j = i + 1 if i + 1 < n else 0
        bx = v[j, 0] - cx
        by = v[j, 1] - cy
        cross = ax * by - ay * bx
        twice += cross
        moment += cross * (ax * ax + ay * ay + ax * bx + ay * by + bx * bx + by * by)
    if twice == 0.0:
        return 0.0
    return moment / (6.0 * twice)
