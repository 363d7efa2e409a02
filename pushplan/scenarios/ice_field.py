"""`IceField`: the floes of a broken ice cover."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.world.checks import ArrayRecord, FloatArray, checked_bounds, frozen
from pushplan.world.convex_shapes import areas_and_centres, disjoint, shapes_of
from pushplan.world.outline import ConvexParts


@dataclass(frozen=True, eq=False)
class IceField(ArrayRecord):
    """Floes on a rectangle of water.

    Args:
        floes: K shapes in the world frame: corners (N, 2) [m], or what else
            `pushplan.world.Movables.from_outlines` takes; kept as their convex parts.
        bounds: (4,) x_min, y_min, x_max, y_max of the ice-covered water [m].

    Raises:
        InvalidInputError: if a floe has no area or crosses itself, or the bounds are empty.
            Whether floes overlap is not looked at here: `load_ice` does, and `generate_ice` makes
            none.
    """

    floes: tuple[ConvexParts, ...]
    bounds: FloatArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "bounds", checked_bounds("ice bounds", self.bounds))
        put(self, "floes", tuple(shapes_of("floe", self.floes)))

    def __len__(self) -> int:
        return len(self.floes)

    @cached_property
    def areas(self) -> FloatArray:
        """(K,) areas of the floes [m²]."""
        return frozen(areas_and_centres([disjoint(parts) for parts in self.floes])[0])

    @property
    def radii(self) -> FloatArray:
        """(K,) radii of the discs with the areas of the floes [m]."""
        return frozen(np.sqrt(self.areas / np.pi))

    @property
    def concentration(self) -> float:
        """Area of the floes over the area within the bounds."""
        return float(self.areas.sum() / np.prod(self.bounds[2:] - self.bounds[:2]))
