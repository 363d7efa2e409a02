"""Distances from coordinates as TSPLIB 95 defines them (Reinelt 1995, section 2)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.world.checks import FloatArray, choice, integer

LARGEST_DIMENSION = 12_000
"""Most nodes: their costs take 1.2 GB, and the solver as much again."""
_ROWS = 256  # rows at a time, as a step from node to node takes twice the memory of its length
EARTH_RADIUS_KM = 6378.388
TSPLIB_PI = 3.141592


def _nearest(values: FloatArray) -> FloatArray:
    result: FloatArray = np.floor(values + 0.5)
    return result


def _length(steps: FloatArray) -> FloatArray:
    length: FloatArray = np.sqrt(steps[..., 0] ** 2 + steps[..., 1] ** 2)
    return length


def _att(steps: FloatArray) -> FloatArray:
    exact = np.sqrt((steps**2).sum(-1) / 10.0)
    rounded = _nearest(exact)
    result: FloatArray = np.where(rounded < exact, rounded + 1.0, rounded)
    return result


def _geo(at: FloatArray, others: FloatArray) -> FloatArray:
    """Degrees and minutes as DDD.MM; degrees are cut off, as the published optima need it."""
    latitude, longitude = _radians(at)
    latitudes, longitudes = _radians(others)
    q1 = np.cos(longitude[:, None] - longitudes[None])
    q2 = np.cos(latitude[:, None] - latitudes[None])
    q3 = np.cos(latitude[:, None] + latitudes[None])
    angle = np.arccos(np.clip(0.5 * ((1.0 + q1) * q2 - (1.0 - q1) * q3), -1.0, 1.0))
    result: FloatArray = np.floor(EARTH_RADIUS_KM * angle + 1.0)
    return result


def _radians(at: FloatArray) -> FloatArray:
    degrees = np.trunc(at)
    angles: FloatArray = (TSPLIB_PI * (degrees + 5.0 * (at - degrees) / 3.0) / 180.0).T
    return angles


_RULES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "ATT": _att,
    "CEIL_2D": lambda steps: np.ceil(_length(steps)),
    "EUC_2D": lambda steps: _nearest(_length(steps)),
    "MAN_2D": lambda steps: _nearest(np.abs(steps).sum(-1)),
    "MAX_2D": lambda steps: np.max(_nearest(np.abs(steps)), axis=-1),
}
"""Rules for the steps (N, N, 2) from each point to each other."""
COORDINATE_TYPES = tuple(sorted({*_RULES, "GEO"}))
"""The weight types that need coordinates."""


def distances(coordinates: FloatArray, weight_type: str) -> FloatArray:
    """The (N, N) costs that follow from (N, 2) coordinates.

    Raises:
        InvalidInputError: if there is no such rule, or more than `LARGEST_DIMENSION` nodes.
    """
    choice("weight type", weight_type, COORDINATE_TYPES)
    count = integer("the number of nodes", len(coordinates), low=1, high=LARGEST_DIMENSION)
    result = np.empty((count, count))
    for first in range(0, count, _ROWS):
        at = coordinates[first : first + _ROWS]
        if weight_type == "GEO":
            result[first : first + _ROWS] = _geo(at, coordinates)
        else:
            result[first : first + _ROWS] = _RULES[weight_type](at[:, None] - coordinates[None])
    if weight_type == "GEO":
        np.fill_diagonal(result, 0.0)
    return result
