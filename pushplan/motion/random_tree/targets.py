"""Targets towards which a tree grows: mostly near a coarse path, sometimes anywhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.world.checks import FloatArray

_BLOCK = 128  # targets that are drawn at once, as a draw of few takes as long
_HEADING_SPREAD = 0.4  # standard deviation of headings about the coarse path [rad]


@dataclass(eq=False)
class Targets:
    """Draws the poses that a tree grows towards."""

    coarse: FloatArray  # (N, 2) coarse path to the goal [m]
    fraction: float  # of the targets that are near it; the others are uniform
    spread: float  # standard deviation of those about it [m]
    bounds: FloatArray  # (4,) of the workspace
    rng: np.random.Generator

    def __post_init__(self) -> None:
        coarse = self.coarse
        index = np.arange(len(self.coarse))
        ahead = coarse[np.minimum(index + 3, len(coarse) - 1)]
        behind = coarse[np.maximum(index - 3, 0)]
        self.headings = np.arctan2(ahead[:, 1] - behind[:, 1], ahead[:, 0] - behind[:, 0])
        self.block = np.empty((0, 3))
        self.used = 0

    def __call__(self) -> FloatArray:
        """The next target (3,)."""
        if self.used == len(self.block):
            self.block = self._draw(_BLOCK)
            self.used = 0
        self.used += 1
        target: FloatArray = self.block[self.used - 1]
        return target

    def _draw(self, count: int) -> FloatArray:
        rng = self.rng
        bounds = self.bounds
        near = rng.random(count) < self.fraction
        index = rng.integers(len(self.coarse), size=count)
        offsets = rng.standard_normal((count, 3)) * [self.spread, self.spread, _HEADING_SPREAD]
        coarsed = np.column_stack([self.coarse[index], self.headings[index]]) + offsets
        spread = rng.random((count, 3))
        low = [*bounds[:2], -np.pi]
        high = [*bounds[2:], np.pi]
        uniform = low + spread * (np.asarray(high) - low)
        return np.where(near[:, None], coarsed, uniform)
