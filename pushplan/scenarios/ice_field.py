"""`IceField`: the floes of a broken ice cover."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.world.checks import ArrayRecord, FloatArray, checked_bounds, frozen
from pushplan.world.outline import areas_and_centroids, convex_outlines, flatten


@dataclass(frozen=True, eq=False)
class IceField(ArrayRecord):
    """Convex floes on a rectangle of water.

    Args:
        polygons: K convex outlines, each (N, 2) corners [m], world frame.
        bounds: (4,) x_min, y_min, x_max, y_max of the ice-covered water [m].

    Raises:
        InvalidInputError: if an outline is not convex or has no area, or the bounds are empty.
            Whether floes overlap is not looked at here: `load_ice` does, and `generate_ice` makes
            none.
    """

    polygons: tuple[FloatArray, ...]
    bounds: FloatArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "bounds", checked_bounds("ice bounds", self.bounds))
        put(self, "polygons", tuple(convex_outlines("floe", self.polygons)))

    def __len__(self) -> int:
        return len(self.polygons)

    @cached_property
    def areas(self) -> FloatArray:
        """(K,) areas of the floes [m²]."""
        return frozen(areas_and_centroids(*flatten(self.polygons))[0])

    @property
    def radii(self) -> FloatArray:
        """(K,) radii of the discs with the areas of the floes [m]."""
        return frozen(np.sqrt(self.areas / np.pi))

    @property
    def concentration(self) -> float:
        """Area of the floes over the area within the bounds."""
        return float(self.areas.sum() / np.prod(self.bounds[2:] - self.bounds[:2]))
