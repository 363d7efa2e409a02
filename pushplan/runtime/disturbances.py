"""`Disturbances`: what lies between a planner and a real robot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    PositiveFloat,
)


@dataclass(frozen=True)
class Disturbances(CheckedFields):
    """Departures of perception and actuators from the ideal.

    Args:
        position_noise: standard deviation of every seen x and y, of robot and objects [m].
        heading_noise: the same of every heading [rad].
        delay: between the time that a world shows and the time when it comes in [s].
        loss: fraction of the worlds that never come in.
        burst: mean number of worlds lost one after another.
        rate: worlds seen in a second at most [Hz]; all by default.
        mass_factor: masses that are told over those that objects have.
        lag: time constant of the actuators [s].
        vanish: for what fraction of the time each object is not seen.
        vanish_time: for how long at a time, on average [s].
        jump: fraction of the worlds in which one object is seen elsewhere.
        jump_distance: how far [circumscribed radii of the robot].
    """

    position_noise: NonNegativeFloat = 0.0
    heading_noise: NonNegativeFloat = 0.0
    delay: NonNegativeFloat = 0.0
    loss: Annotated[float, Limits(0.0, 0.95)] = 0.0
    burst: Annotated[float, Limits(1.0)] = 4.0
    rate: Annotated[float, Limits(0.0, open_low=True, finite=False)] = math.inf
    mass_factor: PositiveFloat = 1.0
    lag: NonNegativeFloat = 0.0
    vanish: Annotated[float, Limits(0.0, 0.95)] = 0.0
    vanish_time: PositiveFloat = 2.0
    jump: Annotated[float, Limits(0.0, 0.95)] = 0.0
    jump_distance: NonNegativeFloat = 1.0

    field_prefix: ClassVar[str] = "disturbances "
