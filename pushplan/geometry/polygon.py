"""Measures of simple polygons: area, centroid, inertia."""

from __future__ import annotations

from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.world import InvalidInputError
from pushplan.world.checks import FloatArray, array


def corners(name: str, polygon: ArrayLike) -> FloatArray:
    """Check the corners (N, 2) [m] of a polygon, at least one of them.

    Raises:
        InvalidInputError: naming the polygon otherwise.
    """
    checked: FloatArray = array(name, polygon, (None, 2))
    if len(checked) == 0:
        raise InvalidInputError(f"{name} must have at least one corner, got none")
    return checked


def polygon_area(v: FloatArray) -> float:
    """Shoelace area [m²] of the polygon with corners ``v`` (N, 2) [m], positive if CCW."""
    return core.polygon_area(corners("v", v))


def polygon_centroid(v: FloatArray) -> tuple[float, float]:
    """Centre of area x, y [m] of corners (N, 2); their mean where there is no area."""
    return core.polygon_centroid(corners("v", v))


def polygon_inertia(v: FloatArray) -> float:
    """Second moment ∫ r² dA / A [m²] of corners (N, 2) about the centroid; 0 without area."""
    return core.polygon_inertia(corners("v", v))
