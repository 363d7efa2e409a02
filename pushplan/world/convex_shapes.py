"""Shapes as unions of convex parts; Shapely is loaded only for those that are not convex."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.world.checks import FloatArray
from pushplan.world.outline import (
    ConvexParts,
    areas_and_centroids,
    convex_hull,
    convex_outlines,
    flatten,
    listed,
)


def shapes_of(
    name: str,
    shapes: Sequence[Any],
    called: Callable[[int], str] | None = None,
    *,
    smooth: bool = False,
) -> list[ConvexParts]:
    """The convex parts of each of some shapes.

    Warns once, by an `OutlineWarning`, where outlines were repaired or have changed.

    Args:
        name: of the shapes, for messages.
        shapes: of each the corners (N, 2) [m], a polygon of Shapely, or a list of such outlines.
        called: what messages call shape i; the name and i if None.
        smooth: as in `pushplan.world.outline_repair.outline_parts`.

    Raises:
        InvalidInputError: as `pushplan.world.outline_repair.outline_parts`.
    """
    try:  # nearly always
        parts = [_as_parts(shape) for shape in listed(name, shapes)]
        outlines = iter(convex_outlines(name, [part for each in parts for part in each]))
        return [tuple(next(outlines) for _ in each) for each in parts]
    except InvalidInputError:
        from pushplan.world.outline_repair import cut_outlines

        return cut_outlines(name, shapes, called or (lambda i: f"{name} {i}"), smooth)


def _as_parts(shape: Any) -> tuple[Any, ...]:
    """The outlines of a shape that is given by its parts, or by one outline."""
    several = isinstance(shape, tuple | list) and len(shape) > 0
    if several and all(getattr(part, "ndim", 0) == 2 for part in shape):
        return tuple(shape)
    return (shape,)


def hull_of(parts: ConvexParts) -> FloatArray:
    """(N, 2) convex hull of a shape [m]."""
    if len(parts) == 1:
        return parts[0]
    return convex_hull(np.concatenate(parts))


def listed_corners(parts: ConvexParts) -> list[Any]:
    """The corners of a shape as lists, ready for a file; of several parts one list each."""
    corners = [part.tolist() for part in parts]
    return corners if len(corners) > 1 else corners[0]


def disjoint(parts: ConvexParts) -> ConvexParts:
    """Convex pieces that do not overlap, with the union of some convex parts."""
    if len(parts) == 1:
        return parts
    return _pieces(tuple(part.tobytes() for part in parts))


@lru_cache(maxsize=4_000)  # of a few large ice fields, a millisecond each
def _pieces(corners: tuple[bytes, ...]) -> ConvexParts:
    from pushplan.world.outline_repair import disjoint_pieces

    return disjoint_pieces(tuple(np.frombuffer(part).reshape(-1, 2) for part in corners))


def rings_of(parts: ConvexParts) -> tuple[FloatArray, ...]:
    """Outlines (N, 2) [m] of the union of some convex parts, those of its holes too."""
    if len(parts) == 1:
        return parts
    from pushplan.world.outline_repair import union_rings

    return union_rings(parts)


def areas_and_centres(pieces: Sequence[ConvexParts]) -> tuple[FloatArray, FloatArray]:
    """Areas (K,) [m²] and centroids (K, 2) [m] of shapes made of pieces that do not overlap."""
    counts = np.array([len(each) for each in pieces], dtype=np.int64)
    vertices, offsets = flatten([piece for each in pieces for piece in each])
    areas, centres = areas_and_centroids(vertices, offsets)
    if (counts == 1).all():
        return areas, centres
    first = np.cumsum(counts) - counts
    total = np.add.reduceat(areas, first)
    middles = np.add.reduceat(areas[:, None] * centres, first) / total[:, None]
    middles[counts == 1] = centres[first[counts == 1]]
    return total, middles
