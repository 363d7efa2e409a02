"""Distances from coordinates as TSPLIB 95 defines them (Reinelt 1995, section 2)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.world.checks import FloatArray, choice, integer

LARGEST_DIMENSION = 12_000
"""Most nodes: their costs take 1.2 GB, and the solver as much again."""
_ROWS = 256  # rows at a time, as a rule needs some arrays of that size
EARTH_RADIUS_KM = 6378.388
TSPLIB_PI = 3.141592


def _nearest(values: FloatArray) -> FloatArray:
    result: FloatArray = np.floor(values + 0.5)
    return result


def _straight(at: FloatArray, others: FloatArray) -> FloatArray:
    x, y = _offsets(at, others)
    result: FloatArray = np.sqrt(x * x + y * y)
    return result


def _offsets(at: FloatArray, others: FloatArray) -> FloatArray:
    """(2, R, N) from the others."""
    return at.T[:, :, None] - others.T[:, None]


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


_RULES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "ATT": lambda at, others: np.ceil(np.sqrt((_offsets(at, others) ** 2).sum(axis=0) / 10.0)),
    "CEIL_2D": lambda at, others: np.ceil(_straight(at, others)),
    "EUC_2D": lambda at, others: _nearest(_straight(at, others)),
    "GEO": _geo,
    "MAN_2D": lambda at, others: _nearest(np.abs(_offsets(at, others)).sum(axis=0)),
    "MAX_2D": lambda at, others: _nearest(np.abs(_offsets(at, others)).max(axis=0)),
}
"""Rules for the distances (R, N) from some points to all."""
COORDINATE_TYPES = tuple(sorted(_RULES))
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
        some = slice(first, first + _ROWS)
        result[some] = _RULES[weight_type](coordinates[some], coordinates)
    if weight_type == "GEO":
        np.fill_diagonal(result, 0.0)
    return result
