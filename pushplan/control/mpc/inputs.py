"""A plan's path and a robot's limits, as the controllers of the core read them."""

from __future__ import annotations

from pushplan.core import control
from pushplan.world import Drive, Plan, RobotModel


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
