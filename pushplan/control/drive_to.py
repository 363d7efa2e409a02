"""`DriveTo`: bring a differential drive to a point along a polyline, turning on the spot."""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from pushplan.control.limits import clamp_twist
from pushplan.world import InvalidInputError, RobotModel, Twist
from pushplan.world.checks import FloatArray, array, number

_ALIGNED = math.radians(2.0)
_ASTRAY = math.radians(20.0)
_NEAR, _MISSED = 0.02, 0.1
"""A point counts as reached within the first, or behind the robot within the second [circumscribed
radii]."""
_STALLED = 0.1
_PATIENCE = 2
_ESCAPES = 2  # how often one drive makes room for a turn
_LONGEST = 5  # periods for which a command may stand


class DriveTo:
    """Turns to each point of a polyline in turn and drives straight to it.

    Made for robots that follow a command within a control step. It gives up when the robot has
    hardly moved for some steps, or takes more than twice as long as it should. Where it is told
    that the robot cannot turn, it first backs off by as much as turning takes, or moves ahead if
    there is no room behind.

    Args:
        robot: its limits; a differential drive.
        points: (N, 2) where to go [m], world frame, in order; without the start.
        period: time between two commands [s].

    Raises:
        InvalidInputError: if there is no point, or one is not finite.
    """

    def __init__(self, robot: RobotModel, points: ArrayLike, period: float) -> None:
        self.robot = robot
        self._points: FloatArray = array("points", points, (None, 2))
        if len(self._points) == 0:
            raise InvalidInputError("points must hold at least one point")
        self._period = number("period", period, low=0.0, open_low=True)
        self._near = _NEAR * robot.circumscribed_radius
        self._missed = _MISSED * robot.circumscribed_radius
        self._next = 0
        self._turning = True
        self._stalled = 0
        self._budget = -1
        self._asked = 0.0  # time of full speed that the last command amounts to in one period
        self._last: tuple[float, float, float] | None = None
        self._escapes: list[float] = []  # speeds to try, of the present one first
        self._away = 0.0  # how far to go on with it
        self._freed = 0
        self.arrived = False
        """Whether the last point was reached."""
        self.periods = 1
        """For how many periods the last command stays right if the robot follows it exactly."""

    def command(self, robot_pose: FloatArray, *, held: bool = False) -> Twist | None:
        """The velocity to drive now, None when it is there or has given up.

        Args:
            robot_pose: (3,) x, y [m], theta [rad] now.
            held: whether something is known to have stopped the robot since the last call; it
                then does not drive on, or makes room for its turn.
        """
        x, y, theta = (float(value) for value in robot_pose)
        if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(theta)):
            raise InvalidInputError(f"robot_pose must be finite, got {(x, y, theta)}")
        if self._budget < 0:
            self._budget = self._periods_needed(x, y, theta)
        if self._budget == 0:
            return None
        away = self._break_free(held)
        if away is not None:
            self._last, self._stalled = None, 0
            self.periods = 1
            self._budget -= 1
            return away
        if self._blocked(x, y, theta) or (held and not self._turning):
            return None
        bearing, distance = self._aim(x, y, theta)
        if distance == 0.0:
            self.arrived = True
            return None
        robot, period = self.robot, self._period
        if abs(bearing) > (_ALIGNED if self._turning else _ASTRAY):
            self._turning = True
            periods = _whole(abs(bearing) / (robot.max_turn_rate * period))
            twist = clamp_twist(robot, 0.0, bearing / period)
        else:
            self._turning = False
            periods = _whole(distance / (robot.max_speed * period))
            speed = min(robot.max_speed, distance / period)
            twist = clamp_twist(robot, speed, 2.0 * math.sin(bearing) / distance * speed)
        self.periods = min(periods, self._budget)
        self._budget -= 1
        self._asked = self._period * (
            abs(twist.linear) / robot.max_speed + abs(twist.angular) / robot.max_turn_rate
        )
        return twist

    def _break_free(self, held: bool) -> Twist | None:
        """The next command of a move that makes room for a turn, None if there is no need."""
        robot = self.robot
        if self._escapes and held:  # not this way
            self._escapes.pop(0)
            self._away = self._room
        elif not self._escapes and held and self._turning and self._freed < _ESCAPES:
            self._freed += 1
            self._escapes = [robot.min_speed, robot.max_speed] if robot.min_speed < 0.0 else []
            self._away = self._room
        if not self._escapes:
            return None
        speed = self._escapes[0]
        step = min(self._away, abs(speed) * self._period)
        self._away -= step
        if self._away <= 0.0:
            self._escapes = []
        return clamp_twist(robot, math.copysign(step / self._period, speed), 0.0)

    @property
    def _room(self) -> float:
        """How far the robot has to be from a wall along its side to turn freely there [m]."""
        return self.robot.circumscribed_radius - 0.8 * self.robot.inscribed_radius

    def _aim(self, x: float, y: float, theta: float) -> tuple[float, float]:
        """Bearing [rad] and distance [m] of the point to drive at, distance 0 if there is none."""
        while self._next < len(self._points):
            dx, dy = self._points[self._next, 0] - x, self._points[self._next, 1] - y
            distance = math.hypot(dx, dy)
            bearing = math.remainder(math.atan2(dy, dx) - theta, 2.0 * math.pi)
            missed = not self._turning and abs(bearing) > 0.5 * math.pi
            if distance > (self._missed if missed else self._near):
                return bearing, distance
            self._next += 1
            self._turning = True
        return 0.0, 0.0

    def _periods_needed(self, x: float, y: float, theta: float) -> int:
        """Twice the periods that the way takes without disturbance."""
        seconds = 0.0
        for px, py in self._points.tolist():
            turn = abs(math.remainder(math.atan2(py - y, px - x) - theta, 2.0 * math.pi))
            seconds += math.hypot(px - x, py - y) / self.robot.max_speed
            seconds += turn / self.robot.max_turn_rate
            theta = math.atan2(py - y, px - x)
            x, y = px, py
        return 2 * math.ceil(seconds / self._period) + 8

    def _blocked(self, x: float, y: float, theta: float) -> bool:
        """Whether the robot has hardly moved in the periods before the last few calls."""
        if self._last is not None:
            x0, y0, theta0 = self._last
            moved = math.hypot(x - x0, y - y0) / self.robot.max_speed
            moved += abs(math.remainder(theta - theta0, 2.0 * math.pi)) / self.robot.max_turn_rate
            stalled = moved < _STALLED * self._asked
            self._stalled = self._stalled + 1 if stalled else 0
        self._last = (x, y, theta)
        return self._stalled >= _PATIENCE


def _whole(periods: float) -> int:
    """Full periods, at least one and at most `_LONGEST`."""
    return min(max(1, int(periods + 1e-9)), _LONGEST)
