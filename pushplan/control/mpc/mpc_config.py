"""Parameters of the predictive tracker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
)


@dataclass(frozen=True)
class MpcConfig(CheckedFields):
    """Parameters of `MpcTracker`. R is the robot's circumscribed radius, T = R / max_speed.

    The cost is the integral over time, in units of T, of offset² + ``heading_weight`` heading² +
    ``turn_weight`` (turn rate less that of the path)² + ``smoothness`` (change of turn rate)²,
    with offsets in R, turn rates in 1 / T and their changes in 1 / T².

    Args:
        horizon: N, steps that are looked ahead.
        reach: how far they reach at full speed [R]; the steps are equally long, but never shorter
            than the control period, and the first is the control period itself.
        heading_weight: cost of a heading error [1/rad²].
        turn_weight: cost of turning otherwise than the path does.
        smoothness: cost of changing the turn rate; more is calmer under noise and slower to
            return to the path.
        terminal: factor on the cost of the last step's errors, for what comes after it.
        optimise_speed: let a differential drive depart from the plan's speed.
        speed_weight: cost of doing so, per square of the fraction of ``max_speed``.
        iterations: quadratic programs solved in each call; 1 is the real-time iteration.
        first_iterations: those of the first call on a plan, which has no solution to start from.
        delay: known time between a command and its effect [s]; the pose is predicted over it.
        period: time for which the first command is held [s]; later ones are held for as long as
            the clock of the world shows.
        tolerance: of the solver, absolute and relative.
        solver_iterations: after which the solver gives up.
    """

    horizon: Annotated[int, Limits(2, 100)] = 20
    reach: PositiveFloat = 3.0
    heading_weight: NonNegativeFloat = 0.5
    turn_weight: NonNegativeFloat = 0.02
    smoothness: PositiveFloat = 0.001
    terminal: Annotated[float, Limits(1.0)] = 4.0
    optimise_speed: bool = False
    speed_weight: PositiveFloat = 0.2
    iterations: PositiveInt = 1
    first_iterations: PositiveInt = 4
    delay: NonNegativeFloat = 0.0
    period: PositiveFloat = 0.1
    tolerance: PositiveFloat = 1e-6
    solver_iterations: PositiveInt = 2000
