"""Measures of polygons and of objects: area, centroid, inertia."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.world import InvalidInputError, Movables
from pushplan.world.checks import FloatArray, array
from pushplan.world.outline import unflatten


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


def gyration_squares(movables: Movables) -> FloatArray:
    """Moment of inertia over mass about the origin of each object (K,) [m²].

    The square of the radius of its limit surface: as given, or that of its area as drawn.
    """
    squares = movables.gyration_radii**2
    outlines = unflatten(movables.drawn_vertices, movables.drawn_offsets)
    for k in np.flatnonzero(movables.gyration_radii == 0.0).tolist():
        pieces = outlines[k : k + 1]
        if movables.is_compound:
            pieces = movables.pieces(k)
        squares[k] = _second_moment(pieces)
    return squares


def _second_moment(pieces: tuple[FloatArray, ...]) -> float:
    """Second moment over area [m²] about the origin, of pieces (N, 2) [m] that do not overlap.

    One piece has its centroid there.
    """
    if len(pieces) == 1:
        return core.polygon_inertia(pieces[0])
    areas = np.array([core.polygon_area(piece) for piece in pieces])
    centres = np.array([core.polygon_centroid(piece) for piece in pieces])
    own = np.array([core.polygon_inertia(piece) for piece in pieces])
    return float(areas @ (own + (centres**2).sum(axis=1)) / areas.sum())
