"""A map of what it costs to cover each cell, and how outlines are put on it. Compiled."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.state_lattice.swaths import row_span
from pushplan.world.checks import FloatArray, IntArray


@kernel(allocates=True)
def add_floes(
    outlines: FloatArray,
    offsets: IntArray,
    centres: FloatArray,
    radii: FloatArray,
    prices: FloatArray,
    exponent: float,
    soft: float,
    grid: FloatArray,
) -> None:
    """Spread the price of each floe over the cells whose centres it covers.

    The price is spread in proportion to (1 + ``soft`` - q²)^exponent, where q is the distance from
    the centre over the radius of the disc of the same area, at most 1. An exponent of -1/2 makes
    every strip of a disc, of whatever direction, cost the same; 1 weighs the middle most.

    Args:
        outlines: (V, 2) corners of the floes [cells], row and column; flattened.
        offsets: (K + 1,) where each floe starts.
        centres: (K, 2) [cells].
        radii: (K,) radius of the disc of the same area [cells].
        prices: (K,) what it costs to cover the whole floe.
        exponent: see above.
        soft: see above; positive where the exponent is negative.
        grid: (rows, columns) added to in place.
    """
    rows, columns = grid.shape
    for k in range(radii.shape[0]):
        outline = outlines[offsets[k] : offsets[k + 1]]
        top, bottom = outline[:, 0].min(), outline[:, 0].max()
        if prices[k] == 0.0 or bottom < 0.0 or top > rows - 1:
            continue
        first_row, last_row = int(np.ceil(top)), int(np.floor(bottom))
        total = 0.0
        square = 1.0 / max(radii[k] * radii[k], 1e-12)
        for fill in range(2):  # weigh all cells of the floe, then fill those on the map
            share = prices[k] / total if fill == 1 else 0.0
            for row in range(first_row, last_row + 1):
                if fill == 1 and (row < 0 or row >= rows):
                    continue
                low, high = row_span(outline, float(row))
                dr = (row - centres[k, 0]) ** 2
                for column in range(int(np.ceil(low)), int(np.floor(high)) + 1):
                    q = min((dr + (column - centres[k, 1]) ** 2) * square, 1.0)
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
                        grid[row, column] += share * weight
            if total == 0.0:  # a sliver between the centres of cells
                row, column = int(np.round(centres[k, 0])), int(np.round(centres[k, 1]))
                if 0 <= row < rows and 0 <= column < columns:
                    grid[row, column] += prices[k]
                break


@kernel(allocates=True)
def block(outlines: FloatArray, offsets: IntArray, margin: float, grid: FloatArray) -> None:
    """Set to 1 every cell within ``margin`` [cells] of one of some convex outlines.

    Args:
        outlines: (V, 2) corners [cells], flattened, in order around each outline.
        offsets: (S + 1,) where each outline starts.
        margin: at least half the diagonal of a cell, so that no overlap is missed.
        grid: (rows, columns) changed in place.
    """
    rows, columns = grid.shape
    for s in range(offsets.shape[0] - 1):
        outline = outlines[offsets[s] : offsets[s + 1]]
        count = outline.shape[0]
        first = max(int(np.floor(outline[:, 0].min() - margin)), 0)
        last = min(int(np.ceil(outline[:, 0].max() + margin)), rows - 1)
        left = max(int(np.floor(outline[:, 1].min() - margin)), 0)
        right = min(int(np.ceil(outline[:, 1].max() + margin)), columns - 1)
        for row in range(first, last + 1):
            for column in range(left, right + 1):
                inside, near = True, np.inf
                for i in range(count):
                    j = i + 1 if i + 1 < count else 0
                    ex, ey = outline[j, 0] - outline[i, 0], outline[j, 1] - outline[i, 1]
                    px, py = row - outline[i, 0], column - outline[i, 1]
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
