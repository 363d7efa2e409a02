"""`Unseen`: the part of a scene at which nobody has looked yet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pushplan.world.checked_fields import CheckedFields, PositiveFloat, Shape
from pushplan.world.checks import ArrayRecord, BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Unseen(ArrayRecord, CheckedFields):
    """Cells that no sensor has looked at. What stands there is not in the `World`.

    Args:
        cells: (rows, columns) True where nobody has looked, row 0 at the least y.
        resolution: side of a cell [m].
        origin: (2,) x, y [m] of the outer corner of cell (0, 0), world frame.

    Raises:
        InvalidInputError: if a member has the wrong type or shape.
    """

    field_prefix = "unseen."

    cells: Annotated[BoolArray, Shape("rows", "columns")]
    resolution: PositiveFloat
    origin: Annotated[FloatArray, Shape(2)]

    def centres(self, flags: BoolArray) -> FloatArray:
        """(N, 2) middles [m] of the cells that are flagged in (rows, columns)."""
        rows, columns = np.nonzero(flags)
        return self.origin + self.resolution * (np.column_stack([columns, rows]) + 0.5)
