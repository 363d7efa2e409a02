"""Occupancy grids, as robots map with them, to convex polygons."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import InvalidInputError
from pushplan.world.checks import (
    BoolArray,
    FloatArray,
    IntArray,
    array,
    choice,
    integer,
    number,
)
from pushplan.world.outline import transform

UNKNOWN = ("obstacle", "free")
"""Treatments of unknown cells."""
MOST_RECTANGLES = 100_000
"""Greatest number: some seconds and 100 MB. Maps of robots need up to some thousands."""


def occupied_cells(grid: ArrayLike, occupied: int, unknown: str) -> BoolArray:
    """Find the cells of an occupancy grid that are obstacles, (rows, columns).

    Arguments as in `StaticMap.from_occupancy`.

    Raises:
        InvalidInputError: if the grid has another shape, or a value other than -1 to 100.
    """
    choice("treatment of unknown cells", unknown, UNKNOWN)
    least = integer("occupied", occupied, low=1, high=100)
    values: Any = np.asarray(grid)
    if values.dtype.kind not in "biu" or values.ndim != 2 or 0 in values.shape:
        raise InvalidInputError(
            "grid must be an array (rows, columns) of whole numbers or of truth values, "
            f"got {values.dtype} of shape {values.shape}"
        )
    if values.dtype.kind == "b":
        return np.asarray(values, dtype=np.bool_)
    if values.min() < -1 or values.max() > 100:
        wrong = values.min() if values.min() < -1 else values.max()
        raise InvalidInputError(f"grid holds -1 (unknown) and 0 to 100 [%], got {wrong}")
    full: BoolArray = values >= least
    return full | (values < 0) if unknown == "obstacle" else full


def occupancy_polygons(
    full: BoolArray, resolution: float, origin: ArrayLike, beyond: bool
) -> tuple[list[FloatArray], FloatArray]:
    """Obstacles of a grid, and the box around it.

    Args:
        full: (rows, columns) cells that are obstacles.
        resolution: side of a cell [m].
        origin: (2,) or (3,) x, y [m] and theta [rad] of the corner of cell (0, 0).
        beyond: what the box holds beyond a rotated grid is an obstacle too.

    Returns:
        Polygons, each (N, 2) [m], and x_min, y_min, x_max, y_max [m].
    """
    side = number("resolution", resolution, low=0.0, open_low=True)
    place = np.zeros(3)
    given: FloatArray = array("origin", origin, (None,))
    if len(given) not in (2, 3):
        raise InvalidInputError(f"origin must be x, y or x, y, theta, got {given.tolist()}")
    place[: len(given)] = given
    r0, c0, r1, c1 = rectangle_cover(full).T
    corners = np.stack([c0, r0, c1, r0, c1, r1, c0, r1], axis=1).reshape(-1, 2)
    points = _placed(place, side * corners)
    rows, columns = full.shape
    rim = _placed(place, side * np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]]))
    low = rim.min(axis=0)
    high = rim.max(axis=0)
    polygons = list(points.reshape(-1, 4, 2))
    if beyond:
        box = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
        polygons += _triangles(rim, box)
    return polygons, np.concatenate([low, high])


def _placed(origin: FloatArray, points: FloatArray) -> FloatArray:
    """Points of the grid (N, 2) [m] in the world frame, exact where it is not rotated."""
    if origin[2] == 0.0:
        return points + origin[:2]
    return transform(origin, points)


def _triangles(rim: FloatArray, box: FloatArray) -> list[FloatArray]:
    """Cut a rotated rectangle (4, 2) out of the box (4, 2) around it; return the triangles left."""
    found = []
    for a, b in zip(rim, np.roll(rim, -1, axis=0), strict=True):
        outward = np.array([b[1] - a[1], a[0] - b[0]])
        beyond = (box - a) @ outward
        corner = box[int(beyond.argmax())]
        if beyond.max() > 1e-9 * float(outward @ outward):
            found.append(np.array([a, corner, b]))
    return found


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
    by_row = _counts(full)
    by_column = _counts(full.T)
    left = full.copy()
    flat = left.reshape(-1)
    columns = full.shape[1]
    at = 0
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
            wide = left[best[0] : best[2], best[1] : best[3]]
            tall = left[r0:r1, c0:c1]
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
