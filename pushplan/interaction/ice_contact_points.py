"""Compiled contact points of two convex polygons that touch or may soon touch."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction.contact import clip_facing
from pushplan.world.checks import FloatArray


@kernel
def _widest_gap(a: FloatArray, b: FloatArray, enough: float) -> tuple[float, int]:
    """Greatest gap from an edge of ``a`` to ``b`` and that edge; stops at one beyond ``enough``."""
    best, edge = -np.inf, 0
    count = a.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        nx, ny = a[j, 1] - a[i, 1], a[i, 0] - a[j, 0]
        scale = 1.0 / np.sqrt(nx * nx + ny * ny)
        gap = np.inf
        for k in range(b.shape[0]):
            d = (b[k, 0] - a[i, 0]) * nx + (b[k, 1] - a[i, 1]) * ny
            if d < gap:
                gap = d
        gap *= scale
        if gap > best:
            best, edge = gap, i
            if best > enough:
                break
    return best, edge


@kernel
def near_contacts(
    a: FloatArray,  # (N, 2) counter-clockwise corners [m]
    b: FloatArray,  # (M, 2) counter-clockwise corners [m]
    margin: float,  # widest gap that counts [m]
    out: FloatArray,  # (2, 5) x, y [m], unit normal from a to b, gap [m] (negative: overlap)
) -> int:
    """Write 0, 1 or 2 points where two convex polygons touch or may soon touch; their number."""
    gap_a, edge_a = _widest_gap(a, b, margin)
    if gap_a > margin:
        return 0
    gap_b, edge_b = _widest_gap(b, a, margin)
    if gap_b > margin:
        return 0
    if gap_b > gap_a + 1e-9 + 0.01 * abs(gap_a):
        return int(clip_facing(b, edge_b, a, -1.0, margin, False, out))
    return int(clip_facing(a, edge_a, b, 1.0, margin, False, out))
