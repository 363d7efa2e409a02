"""Distances from coordinates as TSPLIB 95 defines them (Reinelt 1995, section 2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.world.checks import FloatArray, choice, integer

LARGEST_DIMENSION = 12_000
"""Most nodes: all their costs take 1.2 GB."""
_ROWS = 256  # rows at a time, as a rule needs some arrays of that size
_FARTHEST = 1e140  # coordinates whose squares are finite
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
    """(2, ...) from the others."""
    return np.stack([at[..., 0] - others[..., 0], at[..., 1] - others[..., 1]])


def _geo(at: FloatArray, others: FloatArray) -> FloatArray:
    """Degrees and minutes as DDD.MM; degrees are cut off, as the published optima need it."""
    latitude, longitude = _radians(at)
    latitudes, longitudes = _radians(others)
    q1 = np.cos(longitude - longitudes)
    q2 = np.cos(latitude - latitudes)
    q3 = np.cos(latitude + latitudes)
    angle = np.arccos(np.clip(0.5 * ((1.0 + q1) * q2 - (1.0 - q1) * q3), -1.0, 1.0))
    result: FloatArray = np.floor(EARTH_RADIUS_KM * angle + 1.0)
    return result


def _radians(at: FloatArray) -> FloatArray:
    degrees = np.trunc(at)
    angles: FloatArray = TSPLIB_PI * (degrees + 5.0 * (at - degrees) / 3.0) / 180.0
    return np.moveaxis(angles, -1, 0)


_RULES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "ATT": lambda at, others: np.ceil(np.sqrt((_offsets(at, others) ** 2).sum(axis=0) / 10.0)),
    "CEIL_2D": lambda at, others: np.ceil(_straight(at, others)),
    "EUC_2D": lambda at, others: _nearest(_straight(at, others)),
    "GEO": _geo,
    "MAN_2D": lambda at, others: _nearest(np.abs(_offsets(at, others)).sum(axis=0)),
    "MAX_2D": lambda at, others: _nearest(np.abs(_offsets(at, others)).max(axis=0)),
}
"""Rules for the distances between points (..., 2) and others."""
COORDINATE_TYPES = tuple(sorted(_RULES))
"""The weight types that need coordinates."""


class Distances:
    """The (N, N) costs that follow from (N, 2) coordinates; only what is asked for is made.

    It takes the place of an array where whole rows, or entries of two arrays of numbers that
    broadcast, are read.

    Raises:
        InvalidInputError: if there is no such rule, or more than `LARGEST_DIMENSION` nodes.
    """

    dtype = np.dtype(np.float64)

    def __init__(self, coordinates: FloatArray, weight_type: str) -> None:
        choice("weight type", weight_type, COORDINATE_TYPES)
        integer("the number of nodes", len(coordinates), low=1, high=LARGEST_DIMENSION)
        self._at = coordinates
        self._type = weight_type
        self.all_finite = bool((np.abs(coordinates) <= _FARTHEST).all())

    def __len__(self) -> int:
        return len(self._at)

    @property
    def T(self) -> Distances:
        """The transpose: distances are the same both ways."""
        return self

    def __getitem__(self, key: Any) -> FloatArray:
        if not isinstance(key, tuple):
            key = key[:, None], np.arange(len(self))
        rows, columns = key
        costs = _RULES[self._type](self._at[rows], self._at[columns])
        if self._type == "GEO":
            costs[rows == columns] = 0.0
        return costs


def distances(coordinates: FloatArray, weight_type: str) -> FloatArray:
    """All costs of `Distances`, as an array."""
    some = Distances(coordinates, weight_type)
    result = np.empty((len(some), len(some)))
    for first in range(0, len(some), _ROWS):
        rows = np.arange(first, min(first + _ROWS, len(some)))
        result[rows] = some[rows]
    return result
