"""Parameters of a state lattice and of the paths found in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Self

from pushplan.motion.state_lattice.primitive_set import PrimitiveConfig
from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    OneOf,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)

HEURISTICS = ("estimate", "bound")


@dataclass(frozen=True)
class LatticeConfig(CheckedFields):
    """Parameters of a `LatticeBuilder`. R is the circumscribed radius, B twice the inscribed one.

    Args:
        headings: of the lattice, 8, 16 or 32.
        variants: primitives from one heading to another one.
        shifts: lane changes to each side.
        step: of the lattice, about [B]; the turning radius is a whole number of steps.
        cells_per_step: cells of the cost map in a step of the lattice.
        turn_fraction: fraction of the greatest turn rate that plans use; the rest is for tracking.
        inset: how far beyond the goal line a path ends [R].
        horizon: how far ahead a path goes at most [R].
        spacing: distance between the poses of a path [R].
        heuristic: a "bound" below the cost to go, with which the path costs at most ``inflation``
            times the least, or an "estimate" of it, with which it is found with far fewer nodes,
            and has cost 0 to 3 % more than the least in Ship-Ice.
        inflation: factor on the heuristic.
    """

    headings: int = 16
    variants: int = 2
    shifts: int = 3
    step: PositiveFloat = 0.5
    cells_per_step: PositiveInt = 4
    turn_fraction: PositiveFraction = 0.9
    inset: NonNegativeFloat = 0.2
    horizon: PositiveFloat = 60.0
    spacing: PositiveFloat = 0.15
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
