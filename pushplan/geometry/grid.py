"""Regular grids over the floor, and the static map on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.geometry.obstacles import grown_map
from pushplan.world import InvalidInputError, StaticMap
from pushplan.world.checked_fields import CheckedFields, PositiveFloat, Shape
from pushplan.world.checks import (
    ArrayRecord,
    BoolArray,
    FloatArray,
    IntArray,
    checked_bounds,
    expect,
    frozen,
    integer,
    number,
)

MAX_CELLS = 50_000_000
_PIECE = 400_000  # distances to corners between two looks at the stop rule: about 2 ms


@dataclass(frozen=True, eq=False)
class Grid(ArrayRecord, CheckedFields):
    """Square cells; row i runs along y, column j along x.

    The centre of cell (i, j) is at ``origin + ((j + 0.5), (i + 0.5)) * resolution``.

    Args:
        origin: (2,) corner of the grid with least x and y [m], world frame.
        resolution: side of a cell [m].
        shape: rows, columns.
    """

    field_prefix = "grid."

    origin: Annotated[FloatArray, Shape(2)]
    resolution: PositiveFloat
    shape: tuple[int, int]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.shape, Sequence) or len(self.shape) != 2:
            raise InvalidInputError(f"grid.shape must be (rows, columns), got {self.shape!r}")
        rows, cols = (integer("grid.shape", n, low=1) for n in self.shape)
        if rows * cols > MAX_CELLS:
            raise InvalidInputError(
                f"a grid may have at most {MAX_CELLS} cells, {rows} x {cols} are too many: "
                "use a coarser resolution"
            )
        object.__setattr__(self, "shape", (rows, cols))

    @classmethod
    def cover(cls, bounds: ArrayLike, resolution: float) -> Grid:
        """The smallest grid from the lower corner of ``bounds`` (4,) [m] that covers them."""
        box = checked_bounds("bounds", bounds)
        step = number("resolution", resolution, low=0.0, open_low=True)
        # a width of 15.000000000001 cells is 15 cells
        cols, rows = (max(1, math.ceil(w / step - 1e-9)) for w in (box[2:] - box[:2]).tolist())
        return cls(box[:2], step, (rows, cols))

    @property
    def x(self) -> FloatArray:
        """(columns,) x of the cell centres [m]."""
        centres: FloatArray = self.origin[0] + (np.arange(self.shape[1]) + 0.5) * self.resolution
        return centres

    @property
    def y(self) -> FloatArray:
        """(rows,) y of the cell centres [m]."""
        centres: FloatArray = self.origin[1] + (np.arange(self.shape[0]) + 0.5) * self.resolution
        return centres

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell that holds a point; may lie outside the grid."""
        col = math.floor((x - self.origin[0]) / self.resolution)
        row = math.floor((y - self.origin[1]) / self.resolution)
        return row, col


def clearance_field(
    static: StaticMap, grid: Grid, stopped: Callable[[], bool] = lambda: False
) -> FloatArray:
    """Distance [m] of each cell centre to the nearest static obstacle, as (rows, columns).

    Exact Euclidean distance outside the obstacles, negative inside (minus the depth in the
    obstacle in which the cell lies deepest), inf in a map without obstacles. The bounds of the
    map are no obstacle. It is left undone where ``stopped``, asked every few milliseconds, says so.
    """
    expect("grid", grid, Grid)
    out = np.empty(grid.shape)
    shapes = grown_map(expect("static", static, StaticMap)).obstacles
    piece = 1 + _PIECE // (1 + len(shapes.vertices))
    for first in range(0, out.size, piece):
        if stopped():
            break
        last = min(first + piece, out.size)
        shapes.fill_clearance(out, first, last, grid.origin, grid.resolution)
    return frozen(out)


def occupancy(static: StaticMap, grid: Grid, clearance: float = 0.0) -> BoolArray:
    """Check which cell centres are in a static obstacle or within ``clearance`` [m] of one.

    Returns:
        (rows, columns) flags.
    """
    margin = number("clearance", clearance, low=0.0)
    return frozen(clearance_field(static, grid) <= margin)


def nearest_marked(marked: BoolArray) -> tuple[FloatArray, IntArray, IntArray]:
    """Find the marked cell that is nearest to each cell.

    It gives what `scipy.ndimage.distance_transform_edt` gives, whose import takes longer than that
    of all planners.

    Args:
        marked: (rows, columns).

    Returns:
        (rows, columns) each: distance [cells], row and column of that cell; the two are -1 where
        none is marked.
    """
    rows = np.empty(marked.shape, dtype=np.int64)
    cols = np.empty_like(rows)
    core.find_nearest_marked(np.ascontiguousarray(marked, dtype=np.bool_), rows, cols)
    i, j = np.indices(marked.shape)
    return np.sqrt((rows - i) ** 2 + (cols - j) ** 2), rows, cols
