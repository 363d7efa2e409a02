"""`Sighting`: an outline in a snapshot, measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from pushplan.perception.contour_alignment import Contour
from pushplan.world.checks import FloatArray
from pushplan.world.outline import flatten, next_corner

_FLAT = 1e-6  # least area of an outline [squared sides of the box around it]


class Sighting(NamedTuple):
    """An outline in one snapshot: contour (N,), centre x + iy [m] and area [m²] of its hull."""

    contour: Contour
    centre: complex
    area: float
    label: int | None


def sightings_of(points: Sequence[FloatArray], labels: FloatArray | None) -> list[Sighting]:
    """Measure the outlines of a snapshot.

    Args:
        points: M outlines, each (N, 2) corners [m].
        labels: (M,) which object each one is of; None if that is not known.

    Returns:
        Those that have an area, in the same order.
    """
    closed = [i for i, corners in enumerate(points) if len(corners) >= 3]
    if not closed:
        return []
    areas, centres, signs, sizes = _measured([points[i] for i in closed])
    solid = np.flatnonzero(areas > _FLAT * sizes**2).tolist()
    return [
        Sighting(
            _contour(points[closed[i]], signs[i]),
            complex(*centres[i]),
            float(areas[i]),
            None if labels is None else int(labels[i]),
        )
        for i in solid
    ]


def _measured(points: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
    """Of M outlines with three corners or more: what tells a hull from a line, and where it lies.

    Returns:
        (M,) areas [m²] and (M, 2) centroids [m] of the hulls, (M,) positive where the corners run
        counter-clockwise, and (M,) longer sides of the boxes around them [m].
    """
    vertices, offsets = flatten(points)
    counts = np.diff(offsets)
    clouds = np.full(len(points), shapely.MultiPoint())
    owners = np.repeat(np.arange(len(points)), counts)
    shapely.multipoints(shapely.points(vertices), indices=owners, out=clouds)
    hulls = shapely.convex_hull(clouds)
    starts = offsets[:-1]
    shifted = vertices - np.repeat(vertices[starts], counts, axis=0)
    after = shifted[next_corner(offsets)]
    cross = shifted[:, 0] * after[:, 1] - shifted[:, 1] * after[:, 0]
    return (
        shapely.area(hulls),
        shapely.get_coordinates(shapely.centroid(hulls)),
        np.add.reduceat(cross, starts),
        (np.maximum.reduceat(vertices, starts) - np.minimum.reduceat(vertices, starts)).max(axis=1),
    )


def _contour(corners: FloatArray, sign: float) -> Contour:
    """Corners as a contour, counter-clockwise, without the first one repeated at the end."""
    if (corners[0] == corners[-1]).all():
        corners = corners[:-1]
    points = corners[:, 0] + 1j * corners[:, 1]
    return points if sign >= 0.0 else points[::-1]
