"""Occupied cells of a grid as few rectangles."""

from __future__ import annotations

import numpy as np

from pushplan.world.checks import BoolArray, IntArray
from pushplan.world.errors import InvalidInputError

MOST_RECTANGLES = 100_000
"""Greatest number: some seconds and 100 MB. Maps of robots need up to some thousands."""


def rectangle_cover(occupied: BoolArray) -> IntArray:
    """Rectangles whose union is exactly the occupied cells; they may overlap.

    A greedy set cover: for the first cell that is not covered yet, the two candidates are the
    longest row and the longest column of occupied cells through it, each as thick as the cells
    allow; the one that covers more new cells is taken.

    Args:
        occupied: (rows, columns).

    Returns:
        (N, 4) first row, first column, row and column after the last, of each rectangle.

    Raises:
        InvalidInputError: if there are more than `MOST_RECTANGLES`.
    """
    full = np.pad(occupied, 1)  # free cells all round end every run
    by_row, by_column = _counts(full), _counts(full.T)
    left = full.copy()
    flat = left.reshape(-1)
    columns, at = full.shape[1], 0
    found: list[tuple[int, int, int, int]] = []
    while True:
        at += int(flat[at:].argmax())
        if not flat[at]:
            break
        row, column = divmod(at, columns)
        c0, c1 = _run(full[row], column)
        r0, r1 = _run(by_row[c1] - by_row[c0] == c1 - c0, row)
        best = r0, c0, r1, c1
        r0, r1 = _run(full[:, column], row)
        c0, c1 = _run(by_column[r1] - by_column[r0] == r1 - r0, column)
        if (r0, c0, r1, c1) != best:
            wide, tall = left[best[0] : best[2], best[1] : best[3]], left[r0:r1, c0:c1]
            if np.count_nonzero(tall) > np.count_nonzero(wide):
                best = r0, c0, r1, c1
        left[best[0] : best[2], best[1] : best[3]] = False
        found.append(best)
        if len(found) > MOST_RECTANGLES:
            raise InvalidInputError(
                f"the occupied cells need more than {MOST_RECTANGLES:,} rectangles, the most that "
                "a map may have: remove single cells from the grid, or make the cells larger"
            )
    return np.array(found, dtype=np.int64).reshape(-1, 4) - 1


def _counts(full: BoolArray) -> IntArray:
    """(columns + 1, rows) occupied cells of each row before each column."""
    counts = np.zeros((full.shape[1] + 1, full.shape[0]), dtype=np.int64)
    np.cumsum(full.T, axis=0, out=counts[1:])
    return counts


def _run(flags: BoolArray, at: int) -> tuple[int, int]:
    """First index of the run of true flags around ``at``, and the one after its last."""
    return at - int(flags[at::-1].argmin()) + 1, at + int(flags[at:].argmin())
