"""Measures of simple polygons: area, centroid, inertia."""

from __future__ import annotations

import math
from typing import TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.world import InvalidInputError
from pushplan.world.checks import FloatArray, array


def corners(name: str, polygon: ArrayLike) -> FloatArray:
    """Check the corners (N, 2) [m] of a polygon, at least one of them.

    Raises:
        InvalidInputError: naming the polygon otherwise.
    """
    if _is_checked(polygon):  # as those of thousands of floes are
        return polygon
    checked: FloatArray = array(name, polygon, (None, 2))
    if len(checked) == 0:
        raise InvalidInputError(f"{name} must have at least one corner, got none")
    return checked


def _is_checked(polygon: ArrayLike) -> TypeGuard[FloatArray]:
    return (
        type(polygon) is np.ndarray
        and polygon.dtype == np.float64
        and polygon.ndim == 2
        and polygon.shape[1] == 2
        and polygon.flags.c_contiguous
        and len(polygon) > 0
        and math.isfinite(polygon.sum())
    )


def polygon_area(v: FloatArray) -> float:
    """Shoelace area [m²] of the polygon with corners ``v`` (N, 2) [m], positive if CCW."""
    return core.polygon_area(corners("v", v))


def polygon_centroid(v: FloatArray) -> tuple[float, float]:
    """Centre of area x, y [m] of corners (N, 2); their mean where there is no area."""
    return core.polygon_centroid(corners("v", v))


def polygon_inertia(v: FloatArray) -> float:
    """Second moment ∫ r² dA / A [m²] of corners (N, 2) about the centroid; 0 without area."""
    return core.polygon_inertia(corners("v", v))
