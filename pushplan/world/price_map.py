"""`PriceMap`: places that cost more to drive through, such as those near walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, PositiveFloat, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, array, number

_MOST_PRICED = 99
"""Greatest value of a costmap that is a price: its inscribed cells [%]. 100 is lethal."""


@dataclass(frozen=True, eq=False)
class PriceMap(ArrayRecord, CheckedFields):
    """Prices of places, by the cell in which the robot's reference point is.

    A metre where the price is p counts as much as 1 + p metres elsewhere. `PushAware` and
    `KinodynamicRRT` minimise the sum; other planners do not read it.

    Args:
        prices: (rows, columns) at least 0, row 0 at the least y of the grid.
        resolution: side of a cell [m].
        origin: (3,) x, y [m], theta [rad] of the outer corner of cell (0, 0), world frame.

    Raises:
        InvalidInputError: if a price is negative, or a member has the wrong type or shape.
    """

    field_prefix = "price."

    prices: Annotated[FloatArray, Shape("rows", "columns")]
    resolution: PositiveFloat
    origin: Annotated[FloatArray, Shape(3)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.prices < 0.0).any():
            raise InvalidInputError(f"price.prices must not be negative, got {self.prices.min():g}")

    @classmethod
    def from_costmap(
        cls, grid: ArrayLike, resolution: float, origin: ArrayLike, *, most: float
    ) -> PriceMap:
        """Prices from a costmap of Nav2, as it publishes one as ``nav_msgs/OccupancyGrid``.

        Args:
            grid: (rows, columns) 0 to 100, -1 for unknown. Lethal (100) and unknown cells have no
                price: they are obstacles, which belong into a `StaticMap`.
            resolution: side of a cell [m].
            origin: (3,) as of the class.
            most: price of a cell of 99, from where the inscribed circle touches something.
        """
        cells = array("grid", grid, (None, None))
        wrong = cells[(cells < -1.0) | (cells > 100.0)]
        if len(wrong):
            raise InvalidInputError(f"grid must hold values from -1 to 100, got {wrong[0]:g}")
        priced = np.where((cells > 0) & (cells <= _MOST_PRICED), cells, 0)
        return cls(priced * (number("most", most, low=0.0) / _MOST_PRICED), resolution, origin)  # type: ignore[arg-type]
