"""Cost of the rest of the path if no floe moved: a table that guides the search, compiled.

The table holds, for the ship's place and heading, the least of travel plus weighted work on a grid,
by dynamic programming from the goal line backwards. The work of a metre is taken from the floes as
they lie: each counts with its mass times 1 - d² / R², d being the distance of the bow from its
centre and R their two half widths (after the collision cost of AUTO-IceNav, arXiv 2411.17155), and
more than in proportion where floes crowd: twice as much where as much mass as that of the typical
floe lies ahead. All of it happens in a frame whose y axis points ahead.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray

STEEPEST = math.radians(80.0)
"""Greatest angle between the ship and the direction ahead in the table."""
HEADINGS = 17
_GAIN = 1.5  # work of a metre per mass ahead of the bow
_OUTSIDE = 300.0
"""Cost of each metre beside the channel against a metre of travel: finite, so that costs can be
interpolated, and the search looks for the way back where it has to start there."""


class IceCostToGo(NamedTuple):
    """Costs to go, and what they were made from; lengths in metres."""

    table: FloatArray  # (R, C, H) cost from each row, column and heading to the goal line [kg m]
    field: FloatArray  # (F, D) mass ahead of the bow [kg], on smaller cells
    left: float  # x of the first column of both
    low: float  # y of the first row of both
    column: float  # Distance between the columns of the table
    row: float  # Distance between the rows of the table
    cell: float  # Distance between the rows and the columns of the field
    bow: float  # Distance ahead of the ship's origin at which its bow meets ice
    mass: float  # Of the ship [kg]
    weight: float  # w, cost of work against travel
    radius: float  # Least turning radius


class Floes(NamedTuple):
    """K floes, and the work that they cause."""

    poses: FloatArray  # (K, 3)
    radii: FloatArray  # (K,) of discs with their areas [m]
    masses: FloatArray  # (K,) [kg]
    half_beam: float  # Of the ship [m]


@kernel(allocates=True)
def fill_field(floes: Floes, out: IceCostToGo) -> None:
    """Fill ``out.field``, the mass ahead of a bow at each place, as the module says."""
    field = out.field
    masses = floes.masses
    field[:] = 0.0
    rows, columns = field.shape
    for k in range(floes.poses.shape[0]):
        reach = floes.half_beam + floes.radii[k]
        x = (floes.poses[k, 0] - out.left) / out.cell
        y = (floes.poses[k, 1] - out.low) / out.cell
        span = reach / out.cell
        for r in range(max(0, math.ceil(y - span)), min(rows - 1, math.floor(y + span)) + 1):
            for c in range(max(0, math.ceil(x - span)), min(columns - 1, math.floor(x + span)) + 1):
                square = ((r - y) ** 2 + (c - x) ** 2) / (span * span)
                if square < 1.0:
                    field[r, c] += masses[k] * (1.0 - square)
    if masses.shape[0] > 0:
        typical = np.median(masses)
        for r in range(rows):
            for c in range(columns):
                field[r, c] *= _GAIN * (1.0 + field[r, c] / typical)


@kernel
def _sample(field: FloatArray, r: float, c: float) -> float:
    """Bilinear value of an (F, C) array, that of its edge beyond it."""
    r = min(max(r, 0.0), field.shape[0] - 1.000001)
    c = min(max(c, 0.0), field.shape[1] - 1.000001)
    i = int(r)
    j = int(c)
    u = r - i
    v = c - j
    top = (1.0 - v) * field[i, j] + v * field[i, j + 1]
    value: float = (1.0 - u) * top + u * ((1.0 - v) * field[i + 1, j] + v * field[i + 1, j + 1])
    return value


@kernel
def mass_ahead(costs: IceCostToGo, x: float, y: float, theta: float) -> float:
    """Mass ahead of a ship at a pose [kg]: work of a metre, if no floe had moved before."""
    bx = x + costs.bow * math.cos(theta)
    by = y + costs.bow * math.sin(theta)
    cell = costs.cell
    return _sample(costs.field, (by - costs.low) / cell, (bx - costs.left) / cell)


@kernel
def fill_table(costs: IceCostToGo) -> None:
    """Fill the table of costs to go, from the last row (the goal line) backwards."""
    rows, columns, headings = costs.table.shape
    spread = 2.0 * STEEPEST / (headings - 1)
    costs.table[rows - 1] = 0.0
    for r in range(rows - 2, -1, -1):
        y = costs.low + r * costs.row
        for h in range(headings):
            off = -STEEPEST + h * spread
            length = costs.row / math.cos(off)
            turns = max(1.0, length / costs.radius / spread)
            aside = costs.row * math.tan(off) / costs.column
            for c in range(columns):
                x = costs.left + c * costs.column
                ahead = mass_ahead(costs, x, y, 0.5 * math.pi + off)
                best = np.inf
                for side in range(-1, 2):
                    at = min(max(h + side * turns, 0.0), headings - 1.0)
                    best = min(best, _look_up(costs, r + 1, c - aside, at))
                costs.table[r, c, h] = length * (costs.mass + costs.weight * ahead) + best


@kernel
def _look_up(costs: IceCostToGo, r: int, c: float, h: float) -> float:
    """Bilinear value in one row of the table, with a cost of being beside it."""
    layer = costs.table[r]
    columns, headings = layer.shape
    beside = max(0.0, -c, c - (columns - 1.0))
    c = min(max(c, 0.0), columns - 1.0)
    j = min(int(c), columns - 2)
    k = min(int(h), headings - 2)
    u = c - j
    v = h - k
    near = layer[j, k] + v * (layer[j, k + 1] - layer[j, k])
    far = layer[j + 1, k] + v * (layer[j + 1, k + 1] - layer[j + 1, k])
    value: float = near + u * (far - near) + _OUTSIDE * costs.mass * beside * costs.column
    return value


@kernel
def cost_to_go(costs: IceCostToGo, x: float, y: float, theta: float) -> float:
    """Estimated cost from a pose to the goal line [kg m]."""
    rows, _, headings = costs.table.shape
    off = theta - 0.5 * math.pi
    c = (x - costs.left) / costs.column
    r = (y - costs.low) / costs.row
    # each radian beyond the headings of the table counts like a path beside the channel
    steep = max(0.0, abs(off) - STEEPEST)
    h = min(max((off + STEEPEST) * (headings - 1) / (2.0 * STEEPEST), 0.0), headings - 1.0)
    before = max(0.0, -r) * costs.row  # the ship goes straight up to the first row
    r = min(max(r, 0.0), rows - 1.0)
    i = min(int(r), rows - 2)
    a = _look_up(costs, i, c, h)
    b = _look_up(costs, i + 1, c, h)
    value: float = a + (r - i) * (b - a) + costs.mass * (before + _OUTSIDE * steep * costs.bow)
    return value


@kernel
def cost_ahead(costs: IceCostToGo, arc: FloatArray, step: float) -> tuple[float, float]:
    """Work [kg m] along (N, 4) poses ``step`` [m] apart, if no floe moved, and cost to go after."""
    work = 0.0
    for n in range(1, arc.shape[0]):
        work += step * mass_ahead(costs, arc[n, 0], arc[n, 1], arc[n, 2])
    end = arc[arc.shape[0] - 1]
    return work, cost_to_go(costs, end[0], end[1], end[2])
