"""Parameters of the search for keyholes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.world.checked_fields import (
    CheckedFields,
    Each,
    Fraction,
    NonNegativeFloat,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)


@dataclass(frozen=True)
class KeyholeConfig(CheckedFields):
    """Parameters of `KeyholeSearch`. Lengths are in units of the circumscribed radius R.

    Args:
        push_weight: w, the weight of a unit of interaction work against a unit of travel work.
        clearance: radius of the disc that the robot drives as between pushes [R].
        cell: side of the cells of the configuration space [R].
        margin: clearance kept from walls during a push [R].
        offsets: how far beside the middle of a face the robot pushes, as fractions of half the
            face; beyond 1 it pushes neighbours too.
        longest: length of a push at most [R].
        step: between two places where a push may end [R].
        gain: area of floor that has to become reachable for a push to count as an opening [R²].
        closing: area of floor that may be cut off without being called a closing [R²].
        closing_cost: added to the cost of a push that closes something [R].
        closed_cost: extra cost per metre, of the estimate of what is left, of floor that objects
            close.
        rank_cost: added to the priority of a state each time that it is expanded again, with
            objects that matter less [R].
        default_pushes: simulated at most where no stop rule is given.
    """

    push_weight: NonNegativeFloat = 1.0
    clearance: PositiveFloat = 1.06
    cell: PositiveFraction = 0.1
    margin: Fraction = 0.06
    offsets: Annotated[tuple[float, ...], Each()] = (0.0, 0.5, -0.5, 1.25, -1.25)
    longest: PositiveFloat = 8.0
    step: PositiveFloat = 0.5
    gain: PositiveFloat = 4.0
    closing: NonNegativeFloat = 1.0
    closing_cost: NonNegativeFloat = 20.0
    closed_cost: NonNegativeFloat = 3.0
    rank_cost: NonNegativeFloat = 3.0
    default_pushes: PositiveInt = 600
