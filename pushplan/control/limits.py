"""Keep commands within what the robot can do."""

from __future__ import annotations

import math

from ruckig import ControlInterface, InputParameter, Result, Ruckig, Trajectory

from pushplan.world import Drive, RobotModel, Twist


def clamp_twist(robot: RobotModel, linear: float, angular: float) -> Twist:
    """The nearest twist that the robot's speed and turn limits allow.

    Args:
        robot: gives the limits; a constant-speed robot always drives at ``max_speed``.
        linear: wanted forward speed [m/s].
        angular: wanted turn rate [rad/s].
    """
    if robot.drive is Drive.CONSTANT_SPEED:
        linear = robot.max_speed
    linear = min(max(linear, robot.min_speed), robot.max_speed)
    angular = min(max(angular, -robot.max_turn_rate), robot.max_turn_rate)
    return Twist(linear, angular)


class TwistLimiter:
    """Jerk-limited speed and turn rate, from one command to the next, by Ruckig.

    Ruckig (Berscheid and Kröger, "Jerk-limited Real-time Trajectory Generation with Arbitrary
    Target States", RSS 2021) gives the time-optimal change from the present to the wanted twist;
    the command is where that change has got to after one period. A robot whose accelerations are
    unlimited gets its wanted twist at once.

    Args:
        robot: gives the limits.
        jerk_time: time in which an acceleration may build up [s]; sets the jerk limit.
    """

    def __init__(self, robot: RobotModel, jerk_time: float = 0.1) -> None:
        self.robot = robot
        limits = [robot.max_acceleration, robot.max_turn_acceleration]
        self.limited = any(math.isfinite(limit) for limit in limits)
        self._input = InputParameter(2)
        self._input.control_interface = ControlInterface.Velocity
        self._input.max_acceleration = [min(limit, 1e6) for limit in limits]
        self._input.max_jerk = [min(limit, 1e6) / jerk_time for limit in limits]
        self._solver = Ruckig(2)
        self._velocity, self._acceleration = [0.0, 0.0], [0.0, 0.0]

    def reset(self, linear: float = 0.0, angular: float = 0.0) -> None:
        """Start from a known twist, without acceleration."""
        self._velocity, self._acceleration = [linear, angular], [0.0, 0.0]

    def step(self, wanted: Twist, period: float) -> Twist:
        """The twist to command now so that ``wanted`` is reached as soon as the limits allow.

        Args:
            wanted: where to get to.
            period: time until the next call [s].
        """
        wanted = clamp_twist(self.robot, wanted.linear, wanted.angular)
        if not self.limited:
            return wanted
        problem = self._input
        problem.current_velocity = self._velocity
        problem.current_acceleration = self._acceleration
        problem.target_velocity = [wanted.linear, wanted.angular]
        problem.target_acceleration = [0.0, 0.0]
        change = Trajectory(2)
        if self._solver.calculate(problem, change) not in (Result.Working, Result.Finished):
            return clamp_twist(self.robot, *self._velocity)  # keep going rather than jump
        _, velocity, acceleration = change.at_time(min(period, change.duration))
        self._velocity, self._acceleration = list(velocity), list(acceleration)
        return clamp_twist(self.robot, velocity[0], velocity[1])
