"""Parameters of the predictive ship planners."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checked_fields import (
    CheckedFields,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import integer


@dataclass(frozen=True)
class PredictiveConfig(CheckedFields):
    """Parameters of `PredictiveShip` and `PredictiveShipNetwork`. Lengths in hull lengths.

    Args:
        push_weight: w, the cost of a unit of work on the ice against a unit of the ship's own.
        turn_fraction: fraction of the greatest turn rate that plans use; the rest is for tracking.
        arc: length of the pieces that the search puts together.
        curvatures: to each side of straight ahead.
        width: partial paths kept from piece to piece.
        sparse: with fewer floes than this in reach the beam is wider in proportion, up to twice;
            predictions are cheap then.
        widest: with a stop rule the search begins with a quarter of the width, and is repeated
            with twice as much up to this.
        horizon: length of path for which the ice is predicted; from there on the costs to go count.
        farthest: goal lines that are farther away are approached, with a line at this distance.
        margin: least distance of the ship's origin from the sides of the channel, in half beams.
    """

    push_weight: NonNegativeFloat = 1.5
    turn_fraction: PositiveFraction = 0.9
    arc: PositiveFloat = 0.25
    curvatures: PositiveInt = 3
    width: PositiveInt = 12
    sparse: NonNegativeInt = 150
    widest: int = 48
    horizon: PositiveFloat = 5.0
    farthest: PositiveFloat = 40.0
    margin: NonNegativeFloat = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        integer("widest", self.widest, low=self.width)

    def beam_width(self, floes: int) -> int:
        """Paths kept from piece to piece among so many floes in reach."""
        ratio = self.sparse / max(floes, 1)
        return round(self.width * min(max(ratio, 1.0), 2.0))
