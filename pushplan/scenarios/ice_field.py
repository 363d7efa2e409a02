"""`IceField`: the floes of a broken ice cover; `FloeSizes`: how large they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from pushplan.world import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveFloat
from pushplan.world.checks import ArrayRecord, FloatArray, checked_bounds, frozen
from pushplan.world.convex_shapes import areas_and_centres, disjoint, shapes_of
from pushplan.world.outline import ConvexParts

MARGIN = 0.003
"""Floes are grown this much too large [fraction of the area], and in the end shrunk to measure."""


@dataclass(frozen=True)
class FloeSizes(CheckedFields):
    """Floe sizes, log-normal or by a power law. The radius of a floe is that of an equal disc.

    Args:
        mean_radius: mean of the log-normal distribution before it is cut off [m].
        spread: standard deviation of the logarithm of the radius.
        least: floes are no smaller [m].
        greatest: nor larger [m].
        exponent: if given, the number of floes above a radius falls with this power of it, and mean
            and spread do not matter. Rothrock and Thorndike (Journal of Geophysical Research 89,
            1984) found 1.7 to 2.5 for the diameters of drifting floes.

    Raises:
        InvalidInputError: if they make no sense together.
    """

    field_prefix = "ice "

    mean_radius: PositiveFloat = 0.33
    spread: Annotated[float, Limits(0.0, 2.0)] = 0.28
    least: PositiveFloat = 0.2
    greatest: PositiveFloat = 0.6
    exponent: Annotated[float, Limits(1.1, 5.0)] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.exponent is not None:
            if not self.least < self.greatest:
                raise InvalidInputError(
                    f"ice radii must have least < greatest, got {self.least:g}, {self.greatest:g} m"
                )
        elif not self.least <= self.mean_radius <= self.greatest or self.least == self.greatest:
            raise InvalidInputError(
                "ice radii must have least <= mean_radius <= greatest and least < greatest, got "
                f"{self.least:g}, {self.mean_radius:g}, {self.greatest:g} m"
            )

    @property
    def typical_radius(self) -> float:
        """Mean radius [m]; of log-normal sizes before they are cut off."""
        if self.exponent is None:
            return self.mean_radius
        n = self.exponent
        moment = self.least ** (1.0 - n) - self.greatest ** (1.0 - n)
        return float(n / (n - 1.0) * moment / (self.least**-n - self.greatest**-n))

    def draw(self, rng: np.random.Generator, total_area: float) -> FloatArray:
        """Areas [m²], largest first, whose sum is ``total_area`` [m²] where that is possible.

        It is not where the sum is less than one floe, or the range of sizes is narrow and the
        floes are few.
        """
        high = np.pi * self.greatest**2 / (1.0 + MARGIN)
        low = min(high, np.pi * self.least**2 * (1.0 + 2.0 * MARGIN))
        typical = np.pi * self.typical_radius**2
        count = int(1.5 * total_area / typical) + 32
        radii = self._radii(rng, 4 * count)
        inside = radii[(radii >= self.least) & (radii <= self.greatest)]
        if len(inside) < count:
            inside = np.clip(radii, self.least, self.greatest)
        sums = np.cumsum(np.pi * inside**2)
        number_of = int(np.argmin(np.abs(sums - total_area))) + 1
        areas = np.pi * inside[:number_of] ** 2
        for _ in range(50):  # the last few per mille, within the range of sizes
            areas = np.clip(areas * (total_area / areas.sum()), low, high)
        return np.sort(areas)[::-1].copy()

    def _radii(self, rng: np.random.Generator, count: int) -> FloatArray:
        if self.exponent is None:
            middle = np.log(self.mean_radius) - 0.5 * self.spread**2
            return np.asarray(np.exp(middle + self.spread * rng.standard_normal(count)))
        least = self.least**-self.exponent
        span = self.greatest**-self.exponent - least
        radii: FloatArray = (least + rng.random(count) * span) ** (-1.0 / self.exponent)
        return radii


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
