"""`MppiConfig`: all settings of sampling-based predictive control."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    Limits,
    NonNegativeFloat,
    OneOf,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)

UPDATES = ("mppi", "cem")
"""Exponential weights of all samples, or the mean and the spread of the best ones."""


@dataclass(frozen=True)
class MppiConfig(CheckedFields):
    """Settings; lengths are in circumscribed radii R of the robot, so they fit any size of robot.

    Args:
        update: how samples change the nominal controls: "mppi" or "cem".
        samples: control sequences that are rolled out in each iteration.
        iterations: times that samples are drawn and weighed in a decision.
        steps: steps of the horizon.
        step: length of a step [s]; None for the time in which the robot drives ``stride`` at full
            speed.
        stride: see ``step`` [R].
        knots: points between which controls are interpolated; noise is drawn for these.
        turn_noise: standard deviation of the turn rate at a knot [greatest turn rate].
        speed_noise: the same of the speed [greatest speed]; not for a drive of constant speed.
        exploring: fraction of the samples that are arcs drawn from all that the robot can
            drive, whatever the nominal controls are.
        temperature: of the weights of "mppi", in units of how much the sample at the lower quartile
            costs more than the best one.
        elite: fraction of the samples that "cem" keeps.
        push_weight: w, the weight of a unit of interaction work.
        goal_weight: factor on the cost-to-go at the end of the horizon; None for 3 where the robot
            has a goal itself, and 2 where the objects have. At 1 a robot that may stand has nothing
            to gain by driving, and little more than that is lost among objects.
        approach_weight: factor on the robot's way to behind the object that is to be pushed.
        heading_weight: what it costs to face away from the push there, as a way [R].
        collision_cost: what a rollout costs more that runs into something static or jams, as a
            way [R]; None for 200 where the robot has a goal itself, which it misses then, and 20
            where the objects have.
        margin: distance that rollouts keep from what is static, where they begin farther off [R].
        period: time from one decision to the next [steps].
        patience: time without progress after which another object is turned to, in which the
            robot could have driven so far [R].
    """

    field_prefix = "mppi."

    update: Annotated[str, OneOf(UPDATES)] = "mppi"
    samples: Annotated[int, Limits(2)] = 128
    iterations: PositiveInt = 1
    steps: PositiveInt = 25
    step: PositiveFloat | None = None
    stride: PositiveFloat = 0.3
    knots: Annotated[int, Limits(2)] = 6
    turn_noise: PositiveFloat = 0.5
    speed_noise: PositiveFloat = 0.5
    exploring: Fraction = 0.2
    temperature: PositiveFloat = 0.1
    elite: PositiveFraction = 0.1
    push_weight: NonNegativeFloat = 1.0
    goal_weight: PositiveFloat | None = None
    approach_weight: NonNegativeFloat = 1.0
    heading_weight: NonNegativeFloat = 1.0
    collision_cost: NonNegativeFloat | None = None
    margin: NonNegativeFloat = 0.02
    period: PositiveFloat = 0.5
    patience: PositiveFloat = 30.0
