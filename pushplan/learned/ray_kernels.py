"""Compiled rays against convex outlines."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.transforms import transform_points
from pushplan.world.checks import FloatArray, IntArray


@kernel(allocates=True)
def cast_rays(
    out: FloatArray,  # (N,) lengths [m], ray i at heading + 2 pi i / N; shortened
    x: float,  # where they start [m]
    y: float,  # [m]
    heading: float,  # of the first [rad]
    vertices: FloatArray,  # (V, 2) corners of closed outlines, world frame [m]
    offsets: IntArray,  # (P + 1,) where each outline starts
) -> None:
    """Shorten rays to where they first cross an outline."""
    count = out.shape[0]
    step = 2.0 * np.pi / count
    for k in range(offsets.shape[0] - 1):
        first, end = offsets[k], offsets[k + 1]
        for i in range(first, end):
            j = i + 1 if i + 1 < end else first
            ax, ay = vertices[i, 0] - x, vertices[i, 1] - y
            bx, by = vertices[j, 0] - x, vertices[j, 1] - y
            # only the rays between the bearings of the two ends can cross the edge
            turn = np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
            low = np.arctan2(ay, ax) if turn >= 0.0 else np.arctan2(by, bx)
            start = int(np.ceil((low - heading) / step - 1e-9))
            last = int(np.floor((low + abs(turn) - heading) / step + 1e-9))
            ex, ey = bx - ax, by - ay
            for n in range(start, last + 1):
                c, s = np.cos(heading + n * step), np.sin(heading + n * step)
                across = c * ey - s * ex
                if abs(across) < 1e-15:
                    continue
                away = (ax * ey - ay * ex) / across
                if 0.0 <= away < out[n % count]:
                    out[n % count] = away


@kernel(allocates=True)
def near_outlines(
    x: float,
    y: float,
    reach: float,
    poses: FloatArray,
    radii: FloatArray,
    vertices: FloatArray,
    offsets: IntArray,
) -> tuple[FloatArray, IntArray]:
    """World-frame outlines of the bodies of which a part may lie within ``reach`` [m]."""
    keep = np.zeros(poses.shape[0], dtype=np.int64)
    bodies, corners = 0, 0
    for k in range(poses.shape[0]):
        far = reach + radii[k]
        if (poses[k, 0] - x) ** 2 + (poses[k, 1] - y) ** 2 <= far * far:
            keep[bodies] = k
            bodies += 1
            corners += offsets[k + 1] - offsets[k]
    out, ends = np.empty((corners, 2)), np.zeros(bodies + 1, dtype=np.int64)
    n = 0
    for i in range(bodies):
        k = keep[i]
        size = offsets[k + 1] - offsets[k]
        transform_points(poses[k], vertices[offsets[k] : offsets[k + 1]], out[n : n + size])
        n += size
        ends[i + 1] = n
    return out, ends
