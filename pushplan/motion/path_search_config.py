"""Parameters of planners that grow trees of arcs and shortcut what they find."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    NonNegativeFloat,
    PositiveFraction,
    PositiveInt,
)


@dataclass(frozen=True)
class PathSearchConfig(CheckedFields):
    """Parameters of random trees and shortcutting.

    Lengths are in units of the robot's circumscribed radius R.

    Args:
        push_weight: w, the weight of a unit of interaction work against a unit of travel work:
            the user's trade between E_nav and I_nav.
        margin: clearance kept from walls [R]; less where the robot starts nearer.
        turn_fraction: fraction of the greatest turn rate that plans use; the rest is for tracking.
        default_iterations: budget where no stop rule is given; three times as much while there is
            no plan.
    """

    push_weight: NonNegativeFloat = 3.0
    margin: Fraction = 0.06
    turn_fraction: PositiveFraction = 0.9
    default_iterations: PositiveInt = 4000
