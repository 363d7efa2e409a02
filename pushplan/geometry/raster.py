"""Filling of convex polygons into images, one row of pixels at a time.

Pixel coordinates: x to the right along columns, y down along rows; pixel (r, c) covers
[c, c + 1] × [r, r + 1], so that its centre is at (c + 0.5, r + 0.5).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.core import geometry as core
from pushplan.errors import short
from pushplan.world import InvalidInputError
from pushplan.world.checks import FloatArray, array, expect

_PIXELS = ("uint8", "float32", "float64", "bool", "int32", "int64")


def fill_convex(image: NDArray[Any], vertices_px: FloatArray, value: Any) -> None:
    """Set the pixels whose centres are in a convex polygon of corners (N, 2) x, y [px]."""
    given = expect("image", image, np.ndarray)
    if given.ndim != 2 or given.dtype.name not in _PIXELS:
        raise InvalidInputError(
            f"image must be (rows, columns) of one of {', '.join(_PIXELS)}, "
            f"got {given.dtype.name} of shape {given.shape}"
        )
    try:
        pixel = given.dtype.type(value).item()
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(
            f"value must fit into a pixel of {given.dtype.name}, got {short(value)}"
        ) from error
    corners: FloatArray = array("vertices_px", vertices_px, (None, 2), finite=False)
    pixels = np.ascontiguousarray(given)
    core.fill_convex(pixels, corners, pixel)
    if pixels is not image:
        image[...] = pixels
