"""Parameters of a state lattice and of the paths found in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Self

from pushplan.motion.state_lattice.primitives import PrimitiveConfig
from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    OneOf,
    PositiveFloat,
    PositiveFraction,
)

HEURISTICS = ("estimate", "bound")
SPACING = 0.15
"""Distance between the poses of a path [R]."""


@dataclass(frozen=True)
class LatticeConfig(CheckedFields):
    """Parameters of a `LatticeBuilder`. R is the circumscribed radius, B twice the inscribed one.

    Args:
        headings: of the lattice, 8, 16 or 32.
        variants: primitives from one heading to another one.
        shifts: lane changes to each side.
        turn_fraction: fraction of the greatest turn rate that plans use; the rest is for tracking.
        inset: how far beyond the goal line a path ends [R].
        horizon: how far ahead a path goes at most [R].
        heuristic: a "bound" below the cost to go, with which the path costs at most ``inflation``
            times the least, or an "estimate" of it, with which it is found with far fewer nodes,
            and has cost 0 to 3 % more than the least in Ship-Ice.
        inflation: factor on the heuristic.
    """

    headings: int = 16
    variants: int = 2
    shifts: int = 3
    turn_fraction: PositiveFraction = 0.9
    inset: NonNegativeFloat = 0.2
    horizon: PositiveFloat = 60.0
    heuristic: Annotated[str, OneOf(HEURISTICS)] = "estimate"
    inflation: Annotated[float, Limits(1.0)] = 1.2

    def __post_init__(self) -> None:
        super().__post_init__()
        PrimitiveConfig(self.headings, 1.0, self.variants, self.shifts)

    @classmethod
    def published(cls, **others: Any) -> Self:
        """The lattice of AUTO-IceNav: 8 headings, shortest primitives, an admissible heuristic."""
        return cls(
            headings=8,
            variants=1,
            shifts=0,
            inset=0.02,
            heuristic="bound",
            inflation=1.0,
            **others,
        )
