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
    vertices, offsets = flatten([points[i] for i in closed])
    counts = np.diff(offsets)
    starts = offsets[:-1]
    clouds = np.full(len(closed), shapely.MultiPoint())
    owners = np.repeat(np.arange(len(closed)), counts)
    shapely.multipoints(shapely.points(vertices), indices=owners, out=clouds)
    hulls = shapely.convex_hull(clouds)
    areas = shapely.area(hulls)
    centres = shapely.get_coordinates(shapely.centroid(hulls))
    shifted = vertices - np.repeat(vertices[starts], counts, axis=0)
    after = shifted[next_corner(offsets)]
    cross = shifted[:, 0] * after[:, 1] - shifted[:, 1] * after[:, 0]
    turns = np.add.reduceat(cross, starts)  # positive where corners run counter-clockwise
    boxes = np.maximum.reduceat(vertices, starts) - np.minimum.reduceat(vertices, starts)
    found = []
    for i in np.flatnonzero(areas > _FLAT * boxes.max(axis=1) ** 2).tolist():
        corners = points[closed[i]]
        if (corners[0] == corners[-1]).all():
            corners = corners[:-1]
        contour = corners[:, 0] + 1j * corners[:, 1]
        found.append(
            Sighting(
                contour if turns[i] >= 0.0 else contour[::-1],
                complex(*centres[i]),
                float(areas[i]),
                None if labels is None else int(labels[closed[i]]),
            )
        )
    return found
