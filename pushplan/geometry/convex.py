"""Tests between two convex polygons: penetration, overlap, distance."""

from __future__ import annotations

from pushplan.core import geometry as core
from pushplan.geometry.polygon import corners
from pushplan.world.checks import FloatArray


def convex_penetration(a: FloatArray, b: FloatArray) -> tuple[float, float, float]:
    """Least translation that separates two convex polygons (separating axis theorem).

    Args:
        a: (N, 2) corners [m], counter-clockwise.
        b: (M, 2) corners [m], counter-clockwise.

    Returns:
        depth [m] and a unit normal (nx, ny) that points from ``a`` to ``b``. With depth > 0 they
        overlap and moving ``b`` by ``depth * n`` just separates them; with depth <= 0 they do not,
        and ``-depth`` is the widest gap along an edge normal (at most their distance).
    """
    return core.convex_penetration(corners("a", a), corners("b", b))


def convex_overlap(a: FloatArray, b: FloatArray) -> bool:
    """Return True if two convex counter-clockwise polygons overlap; touching does not count."""
    return core.convex_overlap(corners("a", a), corners("b", b))


def convex_distance(a: FloatArray, b: FloatArray) -> float:
    """Distance [m] between two convex counter-clockwise polygons, 0 if they overlap."""
    return core.convex_distance(corners("a", a), corners("b", b))
