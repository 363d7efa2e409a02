"""What the rest of the way may cost, if no floe moved: a table that guides the search, compiled.

The table holds, for the ship's place and heading, the least of travel plus weighted work on a grid,
by dynamic programming from the goal line backwards. The work of a metre is taken from the floes as
they lie: each counts with its mass times 1 - d² / R², d being the distance of the bow from its
centre and R their two half widths (after the collision cost of AUTO-IceNav, arXiv 2411.17155), and
more than in proportion where floes crowd. All of it happens in a frame whose y axis points ahead.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray

STEEPEST = math.radians(80.0)
"""Greatest angle between the ship and the way ahead in the table."""
HEADINGS = 17
_OUTSIDE = 300.0
"""Price of each metre beside the channel against a metre of travel: finite, so that costs can be
interpolated, and the search looks for the way back where it has to start there."""


class Guide(NamedTuple):
    """Costs to go, and what they were made from; lengths in metres."""

    table: FloatArray
    """(R, C, H) cost from each row, column and heading to the goal line [kg m]."""
    field: FloatArray
    """(F, C) mass in the way of the bow [kg], rows from ``field_low``."""
    left: float
    """x of the first column."""
    low: float
    """y of the first row."""
    column: float
    """Distance between the columns of the table."""
    row: float
    """Distance between the rows of the table."""
    cell: float
    """Distance between the rows and the columns of the field."""
    field_low: float
    """y of its first row; its first column is that of the table."""
    bow: float
    """How far ahead of the ship's origin its bow meets ice."""


@kernel(allocates=True)
def ice_field(
    poses: FloatArray,
    radii: FloatArray,
    masses: FloatArray,
    half_beam: float,
    left: float,
    low: float,
    cell: float,
    price: FloatArray,
    out: FloatArray,
) -> None:
    """Mass in the way of a bow at each place, as the module says.

    Args:
        poses: (K, 3) of the floes.
        radii: (K,) radii of discs with their areas [m].
        masses: (K,) [kg].
        half_beam: of the ship [m].
        left: x of the first column [m].
        low: y of the first row [m].
        cell: distance between rows and columns [m].
        price: (2,) work per mass in the way, and how much more it is for each typical floe in it.
        out: (F, C) receives the masses.
    """
    out[:] = 0.0
    rows, columns = out.shape
    for k in range(poses.shape[0]):
        reach = half_beam + radii[k]
        x, y = (poses[k, 0] - left) / cell, (poses[k, 1] - low) / cell
        span = reach / cell
        for r in range(max(0, math.ceil(y - span)), min(rows - 1, math.floor(y + span)) + 1):
            for c in range(max(0, math.ceil(x - span)), min(columns - 1, math.floor(x + span)) + 1):
                square = ((r - y) ** 2 + (c - x) ** 2) / (span * span)
                if square < 1.0:
                    out[r, c] += masses[k] * (1.0 - square)
    if masses.shape[0] > 0:
        typical = np.median(masses)
        for r in range(rows):
            for c in range(columns):
                out[r, c] *= price[0] * (1.0 + price[1] * out[r, c] / typical)


@kernel(allocates=True)
def _sample(field: FloatArray, r: float, c: float) -> float:
    """Bilinear value of an (F, C) array, that of its edge beyond it."""
    r = min(max(r, 0.0), field.shape[0] - 1.000001)
    c = min(max(c, 0.0), field.shape[1] - 1.000001)
    i, j = int(r), int(c)
    u, v = r - i, c - j
    top = (1.0 - v) * field[i, j] + v * field[i, j + 1]
    value: float = (1.0 - u) * top + u * ((1.0 - v) * field[i + 1, j] + v * field[i + 1, j + 1])
    return value


@kernel(allocates=True)
def in_the_way(guide: Guide, x: float, y: float, theta: float) -> float:
    """Mass in the way of a ship at a pose [kg]: work of a metre, if no floe had moved before."""
    bx, by = x + guide.bow * math.cos(theta), y + guide.bow * math.sin(theta)
    cell = guide.cell
    return _sample(guide.field, (by - guide.field_low) / cell, (bx - guide.left) / cell)


@kernel(allocates=True)
def fill_table(guide: Guide, mass: float, weight: float, radius: float) -> None:
    """Costs to go, from the last row (the goal line) backwards.

    Args:
        guide: ``table`` is filled.
        mass: of the ship [kg].
        weight: price of work against travel.
        radius: least turning radius [m].
    """
    rows, columns, headings = guide.table.shape
    spread = 2.0 * STEEPEST / (headings - 1)
    guide.table[rows - 1] = 0.0
    for r in range(rows - 2, -1, -1):
        y = guide.low + r * guide.row
        for h in range(headings):
            off = -STEEPEST + h * spread
            way = guide.row / math.cos(off)
            turns = max(1.0, way / radius / spread)
            aside = guide.row * math.tan(off) / guide.column
            for c in range(columns):
                x = guide.left + c * guide.column
                share = in_the_way(guide, x, y, 0.5 * math.pi + off)
                best = np.inf
                for side in range(-1, 2):
                    at = min(max(h + side * turns, 0.0), headings - 1.0)
                    best = min(best, _look_up(guide, r + 1, c - aside, at, mass))
                guide.table[r, c, h] = way * (mass + weight * share) + best


@kernel(allocates=True)
def _look_up(guide: Guide, r: int, c: float, h: float, mass: float) -> float:
    """Bilinear value in one row of the table, with a price for being beside it."""
    layer = guide.table[r]
    columns, headings = layer.shape
    beside = max(0.0, -c, c - (columns - 1.0))
    c = min(max(c, 0.0), columns - 1.0)
    j, k = min(int(c), columns - 2), min(int(h), headings - 2)
    u, v = c - j, h - k
    near = layer[j, k] + v * (layer[j, k + 1] - layer[j, k])
    far = layer[j + 1, k] + v * (layer[j + 1, k + 1] - layer[j + 1, k])
    value: float = near + u * (far - near) + _OUTSIDE * mass * beside * guide.column
    return value


@kernel(allocates=True)
def cost_to_go(guide: Guide, x: float, y: float, theta: float, mass: float) -> float:
    """Estimated cost from a pose to the goal line [kg m].

    Args:
        guide: the table.
        x: of the ship's origin [m].
        y: likewise; before the first row the ship goes straight up to it.
        theta: heading [rad]; each radian beyond the table's counts like a way beside the channel.
        mass: of the ship [kg].
    """
    rows, _, headings = guide.table.shape
    off = theta - 0.5 * math.pi
    c, r = (x - guide.left) / guide.column, (y - guide.low) / guide.row
    steep = max(0.0, abs(off) - STEEPEST)
    h = min(max((off + STEEPEST) * (headings - 1) / (2.0 * STEEPEST), 0.0), headings - 1.0)
    before = max(0.0, -r) * guide.row
    r = min(max(r, 0.0), rows - 1.0)
    i = min(int(r), rows - 2)
    a, b = _look_up(guide, i, c, h, mass), _look_up(guide, i + 1, c, h, mass)
    value: float = a + (r - i) * (b - a) + mass * (before + _OUTSIDE * steep * guide.bow)
    return value


@kernel(allocates=True)
def price_ahead(guide: Guide, way: FloatArray, step: float, mass: float) -> tuple[float, float]:
    """What the guide expects along a piece of path and after it.

    Args:
        guide: the table.
        way: (N, 4) poses, the first of which has been reached, and curvatures.
        step: distance between the poses [m].
        mass: of the ship [kg].

    Returns:
        Work along the piece, if no floe had moved before, and cost to go from its end [kg m].
    """
    work = 0.0
    for n in range(1, way.shape[0]):
        work += step * in_the_way(guide, way[n, 0], way[n, 1], way[n, 2])
    end = way[way.shape[0] - 1]
    return work, cost_to_go(guide, end[0], end[1], end[2], mass)


@kernel(allocates=True)
def steer_on(
    guide: Guide,
    pose: FloatArray,
    mass: float,
    weight: float,
    bends: FloatArray,
    step: float,
    out: FloatArray,
) -> int:
    """Drive on in small arcs that the table likes best, to the goal line.

    Args:
        guide: the table.
        pose: (3,) where to begin.
        mass: of the ship [kg].
        weight: price of work.
        bends: (B,) curvatures to choose from [1/m].
        step: length of the arcs [m].
        out: (N, 4) receives poses and the curvature that leads to each.

    Returns:
        The number of poses; 0 where there was no room for all of them.
    """
    goal = guide.low + (guide.table.shape[0] - 1) * guide.row
    x, y, theta = pose[0], pose[1], pose[2]
    for n in range(out.shape[0]):
        if y >= goal:
            return n
        best, chosen = np.inf, 0
        for b in range(bends.shape[0]):
            middle = theta + 0.5 * bends[b] * step
            nx, ny = x + step * math.cos(middle), y + step * math.sin(middle)
            cost = step * (mass + weight * in_the_way(guide, nx, ny, theta + bends[b] * step))
            cost += cost_to_go(guide, nx, ny, theta + bends[b] * step, mass)
            cost += 1e-6 * abs(bends[b])
            if cost < best:
                best, chosen = cost, b
        middle = theta + 0.5 * bends[chosen] * step
        x += step * math.cos(middle)
        y += step * math.sin(middle)
        theta += bends[chosen] * step
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = x, y, theta, bends[chosen]
    return out.shape[0] if y >= goal else 0


@kernel(allocates=True)
def arc_ahead(
    pose: FloatArray,
    bend: float,
    step: float,
    count: int,
    goal: float,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """An arc from a pose on, cut off at the goal line.

    Args:
        pose: (3,) where it begins.
        bend: curvature [1/m].
        step: distance between poses along the arc [m].
        count: how many there are after the first.
        goal: y of the goal line [m].
        low: (2,) least x, y of the channel [m].
        high: (2,) greatest.

    Returns:
        (N, 4) poses and curvature; (0, 4) where it leaves the channel.
    """
    way = np.empty((count + 1, 4))
    way[0, 0], way[0, 1], way[0, 2], way[0, 3] = pose[0], pose[1], pose[2], bend
    for n in range(1, count + 1):
        half = 0.5 * bend * step * n
        chord = step * n * (math.sin(half) / half if half != 0.0 else 1.0)
        x, y = (
            pose[0] + chord * math.cos(pose[2] + half),
            pose[1] + chord * math.sin(pose[2] + half),
        )
        if x < low[0] or x > high[0] or y < low[1] or y > high[1]:
            return way[:0]
        way[n, 0], way[n, 1], way[n, 2], way[n, 3] = x, y, pose[2] + 2.0 * half, bend
        if y >= goal:
            return way[: n + 1]
    return way
