"""Compiled integrals over the outlines of floating bodies."""

from __future__ import annotations

import math

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray


@kernel(allocates=True)
def flow_shapes(
    vertices: FloatArray,  # (V, 2) corners about the centroids [m], counter-clockwise
    offsets: IntArray,  # (K + 1,) where each body starts
) -> FloatArray:
    """(K, 4) mean width [m], area [m²] two rotation integrals [m⁴, m⁵] of convex bodies."""
    # 0: circumference over pi (Cauchy). 2: sum over both halves of each edge of half the integral
    # of |t|³ dt, t along the edge from the foot of the perpendicular, whose speed of rotation meets
    # the water head on (a plate of half length a about its middle has a⁴ / 2). 3: integral of
    # |r|³ dA, by two-point products over the triangles of the outline
    count = offsets.shape[0] - 1
    out = np.zeros((count, 4))
    for k in range(count):
        first, last = offsets[k], offsets[k + 1]
        for i in range(first, last):
            j = i + 1 if i + 1 < last else first
            ax, ay, bx, by = vertices[i, 0], vertices[i, 1], vertices[j, 0], vertices[j, 1]
            ex, ey = bx - ax, by - ay
            long = math.hypot(ex, ey)
            s, t = (ax * ex + ay * ey) / long, (bx * ex + by * ey) / long
            cross = ax * by - ay * bx
            out[k, 0] += long / math.pi
            out[k, 1] += 0.5 * cross
            out[k, 2] += 0.125 * abs(t * abs(t) ** 3 - s * abs(s) ** 3)
            out[k, 3] += cross * _cubed_distance(ax, ay, bx, by)
    return out


@kernel(allocates=True)
def _cubed_distance(ax: float, ay: float, bx: float, by: float) -> float:
    """Mean of |p|³ over the edge a-b, over 5: times the cross product, the triangle's integral."""
    total = 0.0
    # Gauss-Legendre with three points; |r|³ scales with the third power along rays
    for place, weight in ((-0.7745966692414834, 5.0), (0.0, 8.0), (0.7745966692414834, 5.0)):
        u = 0.5 + 0.5 * place
        total += weight / 18.0 * math.hypot(ax + u * (bx - ax), ay + u * (by - ay)) ** 3
    return total / 5.0
