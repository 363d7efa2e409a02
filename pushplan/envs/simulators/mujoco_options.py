"""Numerical and mechanical settings of the MuJoCo simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)


@dataclass(frozen=True)
class MujocoOptions(CheckedFields):
    """Settings; docs/simulators-mujoco.md has the studies behind the defaults.

    Args:
        time_step: longest step of the engine on the ground [s]; a whole number of steps fits
            between two samples.
        water_time_step: longest step where bodies float [s].
        drag_interval: longest time for which the drag coefficient of a floating body is kept [s].
        samples: poses recorded in each call of `MujocoSimulator.step`, at even intervals.
        iterations: most iterations of the contact solver (Newton) in a step.
        tolerance: of the contact solver.
        contact_time: time constant with which an overlap of two bodies decays [s]; MuJoCo needs
            at least two steps.
        impedance: how much of a contact's relative motion the solver takes away in a step, in
            (0, 1); bodies sink into each other by a fraction of ``1 - impedance``.
        sleep_speed: objects that end a step slower than this rest until something touches them
            [m/s].
        motor_time: time constant of the motors' speed control on free ground [s].
        motor_force: push of all motors together, in units of the robot's weight.
        rotor_inertia: inertia of each motor's rotor as its wheel feels it through the gear, in
            units of the robot's mass times the wheel radius squared.
        wheel_friction: sliding friction coefficient of tyres on the ground.
        thrust: greatest acceleration of a ship by its thrusters, ahead and sideways [m/s²].
        thruster_lever: lever of the thrust that turns a ship, in units of its half length.
        thrust_droop: loss of speed at full thrust, in units of the greatest speed.
    """

    field_prefix = "mujoco "

    time_step: PositiveFraction = 0.0125
    water_time_step: PositiveFraction = 0.02
    drag_interval: PositiveFloat = 0.1
    samples: PositiveInt = 8
    iterations: PositiveInt = 30
    tolerance: PositiveFloat = 1e-6
    contact_time: PositiveFloat = 0.025
    impedance: Annotated[float, Limits(0.0, 0.9999, open_low=True)] = 0.98
    sleep_speed: PositiveFloat = 1e-3
    motor_time: PositiveFloat = 0.025
    motor_force: PositiveFloat = 0.8
    rotor_inertia: PositiveFloat = 1.0
    wheel_friction: PositiveFloat = 0.9
    thrust: PositiveFloat = 0.2
    thruster_lever: PositiveFloat = 1.0
    thrust_droop: PositiveFloat = 0.05
