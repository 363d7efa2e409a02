"""Costs of covering floes, and sums over a map of such costs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.world.checks import FloatArray


class FloeCosts(NamedTuple):
    """Costs of covering K floes.

    The cost of a floe is spread over its cells in proportion to (1 + ``soft`` - q²)^``exponent``,
    where q is the distance from its centre over the radius of the disc of the same area, at most 1.
    An exponent of -1/2 makes every strip of a disc, of whatever direction, cost the same; 1 weighs
    the middle most.
    """

    totals: FloatArray  # (K,) of covering the whole floe, in metres of travel
    areas: FloatArray  # (K,) [m²]
    exponent: float
    soft: float  # Positive where the exponent is negative


def column_sums(grid: FloatArray) -> FloatArray:
    """(columns, rows + 1) sums of each column of a (rows, columns) grid before each row."""
    rows, columns = grid.shape
    sums = np.empty((columns, rows + 1))
    core.prefix_sums(grid, sums)
    return sums
