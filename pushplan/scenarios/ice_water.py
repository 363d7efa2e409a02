"""Water that the ice generator fills with floes, as its kernels read it."""

from __future__ import annotations

import math
from typing import NamedTuple

from pushplan.compiled import kernel
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
