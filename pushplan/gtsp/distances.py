"""Distances from coordinates as TSPLIB 95 defines them (Reinelt 1995, section 2)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.world.checks import FloatArray, choice

EARTH_RADIUS_KM = 6378.388
TSPLIB_PI = 3.141592


def _nearest(values: FloatArray) -> FloatArray:
    result: FloatArray = np.floor(values + 0.5)
    return result


def _euclidean(steps: FloatArray) -> FloatArray:
    length: FloatArray = np.sqrt(steps[..., 0] ** 2 + steps[..., 1] ** 2)
    return length


def _euc_2d(at: FloatArray) -> FloatArray:
    return _nearest(_euclidean(at[:, None] - at[None]))


def _ceil_2d(at: FloatArray) -> FloatArray:
    result: FloatArray = np.ceil(_euclidean(at[:, None] - at[None]))
    return result


def _man_2d(at: FloatArray) -> FloatArray:
    return _nearest(np.abs(at[:, None] - at[None]).sum(-1))


def _max_2d(at: FloatArray) -> FloatArray:
    result: FloatArray = np.max(_nearest(np.abs(at[:, None] - at[None])), axis=-1)
    return result


def _att(at: FloatArray) -> FloatArray:
    exact = np.sqrt(((at[:, None] - at[None]) ** 2).sum(-1) / 10.0)
    rounded = _nearest(exact)
    result: FloatArray = np.where(rounded < exact, rounded + 1.0, rounded)
    return result


def _geo(at: FloatArray) -> FloatArray:
    """Degrees and minutes as DDD.MM; degrees are cut off, as the published optima need it."""
    degrees = np.trunc(at)
    latitude, longitude = (TSPLIB_PI * (degrees + 5.0 * (at - degrees) / 3.0) / 180.0).T
    q1 = np.cos(longitude[:, None] - longitude[None])
    q2 = np.cos(latitude[:, None] - latitude[None])
    q3 = np.cos(latitude[:, None] + latitude[None])
    angle = np.arccos(np.clip(0.5 * ((1.0 + q1) * q2 - (1.0 - q1) * q3), -1.0, 1.0))
    result: FloatArray = np.floor(EARTH_RADIUS_KM * angle + 1.0)
    np.fill_diagonal(result, 0.0)
    return result


_RULES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "ATT": _att,
    "CEIL_2D": _ceil_2d,
    "EUC_2D": _euc_2d,
    "GEO": _geo,
    "MAN_2D": _man_2d,
    "MAX_2D": _max_2d,
}

COORDINATE_TYPES = tuple(_RULES)
"""The weight types that need coordinates."""


def distances(coordinates: FloatArray, weight_type: str) -> FloatArray:
    """The (N, N) costs that follow from (N, 2) coordinates.

    Raises:
        InvalidInputError: if there is no such rule.
    """
    rule = _RULES[choice("weight type", weight_type, COORDINATE_TYPES)]
    return rule(coordinates)
