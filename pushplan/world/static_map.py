"""Map of what never moves: walls, columns, dividers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray, array, checked_bounds, frozen
from pushplan.world.convex_shapes import shapes_of
from pushplan.world.occupancy_grid import occupancy_polygons, occupied_cells
from pushplan.world.outline import flatten, listed, outline_boxes, unflatten


@dataclass(frozen=True, eq=False)
class StaticMap(ArrayRecord, CheckedFields):
    """Walls and columns: polygons and thick segments, in the world frame.

    Args:
        polygons: outlines, each (N, 2) [m], or polygons of Shapely; kept as convex parts. Others
            than convex ones are repaired and cut as `pushplan.world.outline_repair` says.
        segments: (S, 4) centre lines x1, y1, x2, y2 [m].
        radii: (S,) half thickness of each segment [m].
        bounds: (4,) x_min, y_min, x_max, y_max [m]: where planners may look for paths. By
            default the box around everything static.

    Raises:
        InvalidInputError: if an outline crosses itself or has no area, a radius is negative, or
            the bounds are empty.
    """

    field_prefix = "static."

    polygons: tuple[FloatArray, ...]
    segments: Annotated[FloatArray, Shape("S", 4)]
    radii: Annotated[FloatArray, Shape("S")]
    bounds: FloatArray

    def __post_init__(self) -> None:
        super().__post_init__()
        put = object.__setattr__
        put(self, "polygons", tuple(_parts(self.polygons)))
        put(self, "bounds", checked_bounds("static.bounds", self.bounds))
        if (self.radii < 0.0).any():
            raise InvalidInputError(f"static.radii must not be negative, got {self.radii.min()}")

    @classmethod
    def build(
        cls,
        polygons: Sequence[Any] = (),
        segments: ArrayLike = (),
        radii: ArrayLike | float = 0.0,
        bounds: ArrayLike | None = None,
    ) -> StaticMap:
        """A map with defaults filled in: one radius for all segments, bounds around all.

        Raises:
            InvalidInputError: as the class; also if there is neither an obstacle nor bounds.
        """
        lines: FloatArray = array("static.segments", segments, (None, 4))
        try:
            thick = np.broadcast_to(np.asarray(radii, dtype=np.float64), (len(lines),))
        except (ValueError, TypeError) as error:
            raise InvalidInputError(
                f"static.radii must be one number or {len(lines)} of them, got {radii!r}"
            ) from error
        if bounds is None:
            polygons = _parts(polygons)
            ends = lines.reshape(-1, 2)
            reach = np.repeat(thick, 2)[:, None]
            every = np.concatenate([*polygons, ends - reach, ends + reach])
            if len(every) == 0:
                raise InvalidInputError("a static map without obstacles needs bounds")
            bounds = np.concatenate([every.min(axis=0), every.max(axis=0)])
        return cls(
            tuple(listed("static.polygons", polygons)),
            lines,
            thick,
            array("static.bounds", bounds, (4,)),
        )

    @classmethod
    def from_occupancy(
        cls,
        grid: ArrayLike,
        resolution: float,
        origin: ArrayLike = (0.0, 0.0),
        *,
        occupied: int = 65,
        unknown: str = "obstacle",
    ) -> StaticMap:
        """A map from an occupancy grid; occupied cells become few rectangles, exactly.

        The union of the polygons is the union of the occupied cells, and the bounds are the box
        around the grid. Values are those of ROS's ``nav_msgs/OccupancyGrid``, whose data belong
        here as ``np.reshape(data, (height, width))``.

        Args:
            grid: (rows, columns) row 0 at the least y: whole numbers, -1 for unknown and else 0 to
                100, the probability in percent that a cell is occupied; or truth values, true for
                an obstacle.
            resolution: side of a cell [m].
            origin: (2,) or (3,) x, y [m] and theta [rad] of the outer corner of cell (0, 0).
            occupied: cells from this value on are obstacles [%].
            unknown: "obstacle" or "free", what unknown cells count as. With obstacles, that is also
                what the bounds hold beyond a grid that is rotated.

        Raises:
            InvalidInputError: if the grid, one of its values or another argument is none of these.
        """
        full = occupied_cells(grid, occupied, unknown)
        beyond = unknown == "obstacle"
        polygons, bounds = occupancy_polygons(full, resolution, origin, beyond)
        return cls.build(polygons, bounds=bounds)

    @property
    def is_empty(self) -> bool:
        """True if nothing stands there: neither a polygon nor a segment."""
        return not len(self.polygons) and not len(self.segments)

    @cached_property
    def convex_parts(self) -> tuple[FloatArray, ...]:
        """Every obstacle as a convex polygon (N, 2) [m].

        A thick segment becomes a polygon around its rounded outline, at most
        1.6 % of the radius too large at the caps and nowhere too small; one of radius 0 becomes
        a millionth of the map thick.
        """
        return unflatten(*self.packed)

    @cached_property
    def packed(self) -> tuple[FloatArray, IntArray]:
        """(V, 2) corners of all convex parts [m], and (S + 1,) where each part starts."""
        vertices, offsets = core_map(self).parts
        return frozen(vertices), frozen(offsets)

    @cached_property
    def boxes(self) -> FloatArray:
        """(S, 4) boxes around the convex parts: x_min, y_min, x_max, y_max [m]."""
        return frozen(outline_boxes(*self.packed))


def _parts(polygons: Sequence[Any]) -> list[FloatArray]:
    return [part for parts in shapes_of("static.polygons", polygons) for part in parts]


@lru_cache(maxsize=64)
def core_map(static: StaticMap) -> core.StaticMap:
    """The map in the core, which keeps all that searches make of it; for the maps used last."""
    return core.StaticMap(*flatten(static.polygons), static.segments, static.radii, static.bounds)
