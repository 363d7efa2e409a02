"""Compiled filling of convex polygons into images, one row of pixels at a time.

Pixel coordinates: x to the right along columns, y down along rows; pixel (r, c) covers
[c, c + 1] × [r, r + 1], so that its centre is at (c + 0.5, r + 0.5).
"""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray


@kernel(allocates=True)
def fill_convex(image: NDArray[Any], vertices_px: FloatArray, value: Any) -> None:
    """Set the pixels whose centres are in a convex polygon of corners (N, 2) x, y [px]."""
    rows, cols = image.shape
    n = vertices_px.shape[0]
    low = math.inf
    high = -math.inf
    for i in range(n):
        low = min(low, vertices_px[i, 1])
        high = max(high, vertices_px[i, 1])
    if not (low <= rows and high >= 0.0):  # also false for NaN
        return
    first = max(0, math.ceil(max(low, 0.0) - 0.5))
    last = min(rows - 1, math.floor(min(high, float(rows)) - 0.5))
    for r in range(first, last + 1):
        y = r + 0.5
        left = math.inf
        right = -math.inf
        j = n - 1
        for i in range(n):
            x0 = vertices_px[j, 0]
            y0 = vertices_px[j, 1]
            x1 = vertices_px[i, 0]
            y1 = vertices_px[i, 1]
            j = i
            if (y0 < y and y1 < y) or (y0 > y and y1 > y):
                continue
            if y0 == y1:
                left = min(left, min(x0, x1))
                right = max(right, max(x0, x1))
            else:
                x = x0 + (x1 - x0) * (y - y0) / (y1 - y0)
                left = min(left, x)
                right = max(right, x)
        if right < 0.0 or left > cols:
            continue
        start = max(0, math.ceil(max(left, 0.0) - 0.5))
        stop = min(cols - 1, math.floor(min(right, float(cols)) - 0.5))
        for c in range(start, stop + 1):
            image[r, c] = value
