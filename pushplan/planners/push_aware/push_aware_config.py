"""Parameters of the push-aware planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.motion.path_search_config import PathSearchConfig
from pushplan.motion.speed_profile import TIGHTEST
from pushplan.world.checked_fields import (
    Fraction,
    Limits,
    NonNegativeFloat,
    PositiveFraction,
    PositiveInt,
)


@dataclass(frozen=True)
class PushAwareConfig(PathSearchConfig):
    """Parameters of `PushAware`: those of its trees and its shortcutting, and of the search.

    Lengths are in units of the robot's circumscribed radius R. Those that are not listed are
    described in `PathSearchConfig`.

    Args:
        heuristic_inflation: factor on the length that is still to go, in the order of the first
            search.
        pruning_factor: factor on that length where a path is given up because it will cost too
            much: the table is up to a tenth too long.
        differential_radius: least turning radius of a differential drive [R]; less where there is
            no way with it.
    """

    push_weight: NonNegativeFloat = 2.5
    turn_fraction: PositiveFraction = 0.98
    margin: Fraction = 0.08
    default_iterations: PositiveInt = 20_000
    differential_radius: Annotated[float, Limits(TIGHTEST)] = 1.0
    heuristic_inflation: NonNegativeFloat = 1.05
    pruning_factor: NonNegativeFloat = 0.92
