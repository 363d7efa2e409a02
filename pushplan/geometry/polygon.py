"""Measures of simple polygons: area, centroid, inertia."""

from __future__ import annotations

import numpy as np

from pushplan.core import geometry as core
from pushplan.world.checks import FloatArray


def polygon_area(v: FloatArray) -> float:
    """Shoelace area [m²] of the polygon with corners ``v`` (N, 2) [m], positive if CCW."""
    return core.polygon_area(np.ascontiguousarray(v, dtype=np.float64))


def polygon_centroid(v: FloatArray) -> tuple[float, float]:
    """Centre of area x, y [m] of corners (N, 2); their mean where there is no area."""
    return core.polygon_centroid(np.ascontiguousarray(v, dtype=np.float64))


def polygon_inertia(v: FloatArray) -> float:
    """Second moment ∫ r² dA / A [m²] of corners (N, 2) about the centroid; 0 without area."""
    return core.polygon_inertia(np.ascontiguousarray(v, dtype=np.float64))
