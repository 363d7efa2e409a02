"""A set of motion primitives of a state lattice, and what it is made from."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from pushplan.core import motion as core
from pushplan.errors import InvalidInputError
from pushplan.world.checks import (
    ArrayRecord,
    FloatArray,
    IntArray,
    frozen,
    integer,
)
from pushplan.world.checks import number as checked_number

DIRECTIONS: dict[int, tuple[tuple[int, int], ...]] = {
    8: ((1, 0), (1, 1)),
    16: ((1, 0), (2, 1), (1, 1), (1, 2)),
    32: ((1, 0), (4, 1), (2, 1), (4, 3), (1, 1), (3, 4), (1, 2), (1, 4)),
}
"""Headings in the first quarter turn, by their number in the whole turn."""


@dataclass(frozen=True)
class PrimitiveConfig:
    """The arguments that a set of primitives is made from; a set is kept under this.

    Args:
        headings: 8, 16 or 32 in the whole turn.
        radius: least turning radius in lattice steps.
        variants: primitives from one heading to another one.
        shifts: primitives that change lane and keep the heading, to each side.
    """

    headings: int = 16
    radius: float = 6.0
    variants: int = 2
    shifts: int = 3

    def __post_init__(self) -> None:
        if self.headings not in DIRECTIONS:
            raise InvalidInputError(
                f"headings must be one of {sorted(DIRECTIONS)}, got {self.headings!r}"
            )
        radius = checked_number("radius", self.radius, low=0.5, high=40.0)
        object.__setattr__(self, "radius", radius)
        integer("variants", self.variants, low=1)
        integer("shifts", self.shifts, low=0)


@dataclass(frozen=True, eq=False)
class PrimitiveSet(ArrayRecord):
    """H headings and P primitives, those of one heading after those of the one before."""

    config: PrimitiveConfig  # parameters that it was made from
    angles: FloatArray  # (H,) headings [rad], increasing from 0
    first: IntArray  # (H + 1,) where the primitives of each heading start
    ends: IntArray  # (P, 3) steps along x and y, and the heading at the end
    pieces: FloatArray  # (P, 3, 2) length [steps] and curvature [1/steps] of the three arcs

    @functools.cached_property
    def lengths(self) -> FloatArray:
        """(P,) [steps]."""
        return frozen(np.ascontiguousarray(self.pieces[:, :, 0].sum(axis=1)))

    @functools.cached_property
    def boxes(self) -> FloatArray:
        """(P, 4) least and greatest x and y along each primitive [steps]."""
        headings = np.repeat(self.angles, np.diff(self.first))
        boxes = np.empty((len(self), 4))
        core.primitive_boxes(headings, self.pieces, self.lengths, boxes)
        return frozen(boxes)

    @functools.cached_property
    def bulge(self) -> int:
        """Greatest distance by which a primitive passes beyond the box of its two ends [steps]."""
        ends = self.ends[:, [0, 0, 1, 1]].astype(np.float64)
        box = np.where([False, True, False, True], np.maximum(ends, 0), np.minimum(ends, 0))
        return int(np.ceil(np.abs(self.boxes - box).max() - 1e-9))

    def __len__(self) -> int:
        return len(self.ends)

    def heading_of(self, primitive: int) -> int:
        """Index of the heading at the start of a primitive."""
        return int(np.searchsorted(self.first, primitive, side="right")) - 1


def directions(headings: int) -> IntArray:
    """(H, 2) whole vectors along the headings of a lattice."""
    quarter = np.array(DIRECTIONS[headings], dtype=np.int64)
    turns = [quarter]
    for _ in range(3):
        turns.append(np.column_stack([-turns[-1][:, 1], turns[-1][:, 0]]))
    return np.concatenate(turns)


def lattice_angles(headings: int) -> FloatArray:
    """(H,) headings of a lattice [rad], increasing from 0."""
    vectors = directions(headings)
    angles = np.arctan2(vectors[:, 1], vectors[:, 0]) % (2.0 * np.pi)
    return angles.astype(np.float64)
