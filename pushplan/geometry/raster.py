"""Filling of convex polygons into images, one row of pixels at a time.

Pixel coordinates: x to the right along columns, y down along rows; pixel (r, c) covers
[c, c + 1] × [r, r + 1], so that its centre is at (c + 0.5, r + 0.5).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.core import geometry as core
from pushplan.world.checks import FloatArray


def fill_convex(image: NDArray[Any], vertices_px: FloatArray, value: Any) -> None:
    """Set the pixels whose centres are in a convex polygon of corners (N, 2) x, y [px]."""
    pixels = np.ascontiguousarray(image)
    corners = np.ascontiguousarray(vertices_px, dtype=np.float64)
    core.fill_convex(pixels, corners, image.dtype.type(value).item())
    if pixels is not image:
        image[...] = pixels
