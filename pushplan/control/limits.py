"""Keep commands within what the robot can do."""

from __future__ import annotations

import math

from pushplan.world import Drive, RobotModel, Twist, World
from pushplan.world.checks import expect, number

try:
    import ruckig
except ImportError:
    ruckig = None

_ENDLESS = 1e9  # speed that stands for an infinite one [m/s]
_BRAKES = 0.5  # fraction of the greatest deceleration that an end is approached with


def clamp_twist(robot: RobotModel, linear: float, angular: float, lateral: float = 0.0) -> Twist:
    """The nearest twist that the robot's speed and turn limits allow.

    Args:
        robot: gives the limits; a constant-speed robot always drives at ``max_speed``, and a car
            turns as its speed allows.
        linear: wanted forward speed [m/s].
        angular: wanted turn rate [rad/s].
        lateral: wanted speed to the left [m/s], of an omnidirectional robot.
    """
    expect("robot", robot, RobotModel)
    linear = number("linear", linear, finite=False)
    angular = number("angular", angular, finite=False)
    if robot.slides:
        lateral = number("lateral", lateral, finite=False)
        linear, lateral = (min(max(v, -_ENDLESS), _ENDLESS) for v in (linear, lateral))
        slower = min(1.0, robot.max_speed / max(math.hypot(linear, lateral), 1e-12))
        turn = min(max(angular, -robot.max_turn_rate), robot.max_turn_rate)
        return Twist(slower * linear, turn, slower * lateral)
    if robot.drive is Drive.CONSTANT_SPEED:
        linear = robot.max_speed
    linear = min(max(linear, robot.min_speed), robot.max_speed)
    most = robot.max_turn_rate
    if robot.drive is Drive.CAR:
        most = min(most, abs(linear) / robot.min_turning_radius)
    angular = min(max(angular, -most), most)
    return Twist(linear, angular)


def arc_twist(robot: RobotModel, length: float, turn: float, least: float = 0.0) -> Twist:
    """The twist that drives an arc as fast as the robot's speed and turn limits allow.

    Args:
        robot: gives the limits.
        length: of the arc, negative for back [m].
        turn: on it [rad].
        least: time that it takes at least [s].
    """
    seconds = max(
        least,
        length / robot.max_speed,
        length / robot.min_speed if robot.min_speed < 0.0 else 0.0,
        abs(turn) / robot.max_turn_rate,
    )
    if seconds == 0.0:
        return Twist(0.0, 0.0)
    return clamp_twist(robot, length / seconds, turn / seconds)


def ramp_twist(
    robot: RobotModel,
    last: Twist,
    linear: float,
    angular: float,
    period: float,
    lateral: float = 0.0,
) -> Twist:
    """The nearest twist that speeds and accelerations allow after the last one.

    The turn rate of a car falls with its speed, however fast that is.

    Args:
        robot: gives the limits.
        last: the twist before.
        linear: wanted forward speed [m/s].
        angular: wanted turn rate [rad/s].
        period: time for which it is held [s].
        lateral: wanted speed to the left [m/s], of an omnidirectional robot.
    """
    dv = robot.max_acceleration * period
    dw = robot.max_turn_acceleration * period
    change = math.hypot(linear - last.linear, lateral - last.lateral)
    if robot.slides and change > dv:
        linear = last.linear + (linear - last.linear) * dv / change
        lateral = last.lateral + (lateral - last.lateral) * dv / change
    linear = min(max(linear, last.linear - dv), last.linear + dv)
    angular = min(max(angular, last.angular - dw), last.angular + dw)
    return clamp_twist(robot, linear, angular, lateral)


def approach_speed(left: float, deceleration: float, held: float) -> float:
    """The speed with which what is left is gone through so as to stand at its end.

    Args:
        left: distance or angle to the end.
        deceleration: the greatest, infinite without a limit.
        held: time for which the command stands [s].
    """
    return min(left / held, math.sqrt(2.0 * _BRAKES * deceleration * max(left, 0.0)))


def driven_twist(world: World) -> Twist:
    """The twist that the robot has, within its limits."""
    assert world.robot_twist is not None
    vx, vy, omega = (float(value) for value in world.robot_twist)
    theta = float(world.robot_pose[2])
    c = math.cos(theta)
    s = math.sin(theta)
    return clamp_twist(world.robot, vx * c + vy * s, omega, vy * c - vx * s)


class TwistLimiter:
    """Jerk-limited speed and turn rate, from one command to the next, by Ruckig.

    Ruckig (Berscheid and Kröger, "Jerk-limited Real-time Trajectory Generation with Arbitrary
    Target States", RSS 2021) gives the time-optimal change from the present to the wanted speed;
    the command is where that change has got to after one period. Speeds ahead and to the side and
    turn rate change independently; one whose acceleration is unlimited gets what is wanted at once.
    Where there is no Ruckig (it has no wheel for Linux on ARM) accelerations are limited and jerk
    is not.

    Args:
        robot: gives the limits.
        jerk_time: time in which an acceleration may build up [s]; sets the jerk limit.

    Raises:
        InvalidInputError: if ``jerk_time`` is not positive.
    """

    def __init__(self, robot: RobotModel, jerk_time: float = 0.1) -> None:
        number("jerk_time", jerk_time, low=0.0, open_low=True)
        self.robot = expect("robot", robot, RobotModel)
        self._speed = _AxisLimiter(robot.max_acceleration, jerk_time)
        self._lateral = _AxisLimiter(robot.max_acceleration, jerk_time)
        self._turn = _AxisLimiter(robot.max_turn_acceleration, jerk_time)

    def reset(self, linear: float = 0.0, angular: float = 0.0, lateral: float = 0.0) -> None:
        """Start from a known twist [m/s, rad/s, m/s], without acceleration."""
        self._speed.reset(linear)
        self._lateral.reset(lateral)
        self._turn.reset(angular)

    def step(self, wanted: Twist, period: float) -> Twist:
        """The twist to command now so that ``wanted`` is reached as soon as the limits allow.

        Args:
            wanted: where to get to.
            period: time until the next call [s], positive.
        """
        number("period", period, low=0.0, open_low=True)
        wanted = clamp_twist(self.robot, wanted.linear, wanted.angular, wanted.lateral)
        return clamp_twist(
            self.robot,
            self._speed.step(wanted.linear, period),
            self._turn.step(wanted.angular, period),
            self._lateral.step(wanted.lateral, period),
        )


class _AxisLimiter:
    """One velocity under a limit of acceleration and jerk."""

    def __init__(self, limit: float, jerk_time: float) -> None:
        self.limit = limit
        self.velocity = self.acceleration = 0.0
        if math.isfinite(limit) and ruckig is not None:
            self._solver = ruckig.Ruckig(1)
            self._input = ruckig.InputParameter(1)
            self._input.control_interface = ruckig.ControlInterface.Velocity
            self._input.max_acceleration = [limit]
            self._input.max_jerk = [limit / jerk_time]
            self._input.target_acceleration = [0.0]

    def reset(self, velocity: float) -> None:
        self.velocity = velocity
        self.acceleration = 0.0

    def step(self, wanted: float, period: float) -> float:
        if not math.isfinite(self.limit):
            self.velocity = wanted
            return wanted
        if ruckig is None:
            return self._ramp(wanted, period)
        self._input.current_velocity = [self.velocity]
        self._input.current_acceleration = [self.acceleration]
        self._input.target_velocity = [wanted]
        change = ruckig.Trajectory(1)
        try:
            self._solver.calculate(self._input, change)
            _, velocity, acceleration = change.at_time(min(period, change.duration))
            self.velocity = velocity[0]
            self.acceleration = acceleration[0]
        except (ruckig.RuckigError, ValueError):  # limits beyond its numbers
            return self._ramp(wanted, period)
        return self.velocity

    def _ramp(self, wanted: float, period: float) -> float:
        """Keep the acceleration alone within its limit."""
        reach = self.limit * period
        self.velocity += min(max(wanted - self.velocity, -reach), reach)
        self.acceleration = 0.0
        return self.velocity
