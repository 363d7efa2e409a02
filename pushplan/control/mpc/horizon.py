"""What predictive controllers in the core need: path, limits, settings of the solver."""

from __future__ import annotations

from typing import Protocol

from pushplan.core import control
from pushplan.world import Drive, Plan, RobotModel


class SolverConfig(Protocol):
    """How a controller solves its programs; see `MpcConfig`."""

    @property
    def tolerance(self) -> float: ...
    @property
    def solver_iterations(self) -> int: ...
    @property
    def iterations(self) -> int: ...
    @property
    def first_iterations(self) -> int: ...


def track_of(plan: Plan) -> control.ReferencePath:
    """The path of a plan as the core reads it."""
    return control.ReferencePath(plan.poses, plan.arc_lengths, plan.speeds)


def limits_of(robot: RobotModel) -> control.CommandLimits:
    """The limits of a robot as the core reads them."""
    return control.CommandLimits(
        robot.drive is Drive.CONSTANT_SPEED,
        robot.min_speed,
        robot.max_speed,
        robot.max_turn_rate,
        robot.max_acceleration,
        robot.max_turn_acceleration,
        robot.min_turning_radius,
    )


def settings_of(config: SolverConfig) -> control.SolverSettings:
    """The settings of the solver as the core reads them."""
    return control.SolverSettings(
        tolerance=config.tolerance,
        iterations=config.solver_iterations,
        rounds=config.iterations,
        first_rounds=config.first_iterations,
    )
