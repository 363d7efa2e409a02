"""A map of what it costs to cover each cell, and how outlines are put on it. Compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.state_lattice.swath_kernels import row_span
from pushplan.world.checks import FloatArray, IntArray


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


class PlacedFloes(NamedTuple):
    """K floes as they lie on a map; row and column in cells."""

    outlines: FloatArray  # (V, 2) corners, flattened
    offsets: IntArray  # (K + 1,) where each floe starts
    centres: FloatArray  # (K, 2)
    radii: FloatArray  # (K,) radius of the disc of the same area [cells]
    costs: FloeCosts


@kernel
def _extent(outline: FloatArray, axis: int) -> tuple[float, float]:
    """Least and greatest coordinate of corners (N, 2)."""
    low = high = outline[0, axis]
    for i in range(1, outline.shape[0]):
        low = min(low, outline[i, axis])
        high = max(high, outline[i, axis])
    return low, high


@kernel
def add_floes(floes: PlacedFloes, grid: FloatArray) -> None:
    """Add the cost of each floe to the cells (rows, columns) whose centres it covers."""
    rows, columns = grid.shape
    exponent = floes.costs.exponent
    soft = floes.costs.soft
    for k in range(floes.radii.shape[0]):
        outline = floes.outlines[floes.offsets[k] : floes.offsets[k + 1]]
        top, bottom = _extent(outline, 0)
        cost = floes.costs.totals[k]
        if cost == 0.0 or bottom < 0.0 or top > rows - 1:
            continue
        first_row = int(np.ceil(top))
        last_row = int(np.floor(bottom))
        total = 0.0
        square = 1.0 / max(floes.radii[k] * floes.radii[k], 1e-12)
        for fill in range(2):  # weigh all cells of the floe, then fill those on the map
            scale = cost / total if fill == 1 else 0.0
            for row in range(first_row, last_row + 1):
                if fill == 1 and (row < 0 or row >= rows):
                    continue
                low, high = row_span(outline, float(row))
                dr = (row - floes.centres[k, 0]) ** 2
                for column in range(int(np.ceil(low)), int(np.floor(high)) + 1):
                    q = min((dr + (column - floes.centres[k, 1]) ** 2) * square, 1.0)
                    base = 1.0 + soft - q
                    if exponent == -0.5:  # a power takes ten times as long
                        weight = 1.0 / np.sqrt(base)
                    elif exponent == 0.0:
                        weight = 1.0
                    else:
                        weight = base if exponent == 1.0 else base**exponent
                    if fill == 0:
                        total += weight
                    elif 0 <= column < columns:
                        grid[row, column] += scale * weight
            if total == 0.0:  # a sliver between the centres of cells
                row = int(np.round(floes.centres[k, 0]))
                column = int(np.round(floes.centres[k, 1]))
                if 0 <= row < rows and 0 <= column < columns:
                    grid[row, column] += cost
                break


@kernel
def _columns_near(outline: FloatArray, row: float, margin: float) -> tuple[float, float]:
    """Least and greatest column of a convex outline within ``margin`` of a row; (0, -1): none."""
    least = np.inf
    most = -np.inf
    count = outline.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        a = outline[i, 0] - row
        b = outline[j, 0] - row
        low = 0.0
        high = 1.0
        if a != b:
            u = (-margin - a) / (b - a)
            v = (margin - a) / (b - a)
            low = max(low, min(u, v))
            high = min(high, max(u, v))
        elif abs(a) > margin:
            continue
        if low <= high:
            along = outline[j, 1] - outline[i, 1]
            least = min(least, outline[i, 1] + min(low * along, high * along))
            most = max(most, outline[i, 1] + max(low * along, high * along))
    return (least, most) if least <= most else (0.0, -1.0 - 2.0 * margin)


@kernel
def block(
    outlines: FloatArray,  # (V, 2) corners of convex outlines [cells], counter-clockwise
    offsets: IntArray,  # (S + 1,) where each outline starts
    margin: float,  # at least half the diagonal of a cell, so that no overlap is missed
    grid: FloatArray,  # (rows, columns)
) -> None:
    """Set to 1 every cell within ``margin`` [cells] of one of some convex outlines."""
    rows, columns = grid.shape
    for s in range(offsets.shape[0] - 1):
        outline = outlines[offsets[s] : offsets[s + 1]]
        count = outline.shape[0]
        low, high = _extent(outline, 0)
        first = max(int(np.floor(low - margin)), 0)
        last = min(int(np.ceil(high + margin)), rows - 1)
        for row in range(first, last + 1):
            low, high = _columns_near(outline, float(row), margin)
            left = max(int(np.floor(low - margin)), 0)
            right = min(int(np.ceil(high + margin)), columns - 1)
            for column in range(left, right + 1):
                inside = True
                near = np.inf
                for i in range(count):
                    j = i + 1 if i + 1 < count else 0
                    ex = outline[j, 0] - outline[i, 0]
                    ey = outline[j, 1] - outline[i, 1]
                    px = row - outline[i, 0]
                    py = column - outline[i, 1]
                    if ex * py - ey * px < 0.0:
                        inside = False
                    t = min(max((px * ex + py * ey) / (ex * ex + ey * ey), 0.0), 1.0)
                    near = min(near, (px - t * ex) ** 2 + (py - t * ey) ** 2)
                if inside or near <= margin * margin:
                    grid[row, column] = 1.0


@kernel(allocates=True)
def prefix_sums(grid: FloatArray) -> FloatArray:
    """(columns, rows + 1) sums of each column of a (rows, columns) grid before each row."""
    rows, columns = grid.shape
    sums = np.empty((columns, rows + 1))
    sums[:, 0] = 0.0
    for top in range(0, rows, 8):  # a few rows at a time: near in memory on both sides
        for column in range(columns):
            total = sums[column, top]
            for row in range(top, min(top + 8, rows)):
                total += grid[row, column]
                sums[column, row + 1] = total
    return sums
