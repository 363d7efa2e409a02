"""`DriveTo`: bring a differential drive to a point along a polyline, turning on the spot."""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from pushplan.control.limits import clamp_twist
from pushplan.world import InvalidInputError, RobotModel, Twist
from pushplan.world.checks import FloatArray, array, number

_ALIGNED = math.radians(2.0)
_ASTRAY = math.radians(20.0)
_STALLED = 0.05
_PATIENCE = 4


class DriveTo:
    """Turns to each point of a polyline in turn and drives straight to it.

    Made for robots that follow a command within a control step. It gives up when the robot has
    hardly moved for some steps, or takes more than twice as long as it should.

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
        self._near = 0.02 * robot.circumscribed_radius
        self._next = 0
        self._turning = True
        self._stalled = 0
        self._budget = -1
        self._last: tuple[float, float, float] | None = None
        self.arrived = False
        """Whether the last point was reached."""

    def command(self, robot_pose: FloatArray) -> Twist | None:
        """The velocity until the next call, None when it is there or has given up.

        Args:
            robot_pose: (3,) x, y [m], theta [rad] now.
        """
        x, y, theta = (float(value) for value in robot_pose)
        if self._budget < 0:
            self._budget = self._steps_needed(x, y, theta)
        if self._blocked(x, y, theta) or self._budget == 0:
            return None
        self._budget -= 1
        distance = 0.0
        while self._next < len(self._points):
            dx, dy = self._points[self._next, 0] - x, self._points[self._next, 1] - y
            distance = math.hypot(dx, dy)
            if distance > self._near:
                break
            self._next += 1
            self._turning = True
        else:
            self.arrived = True
            return None
        bearing = math.remainder(math.atan2(dy, dx) - theta, 2.0 * math.pi)
        if not self._turning and math.cos(bearing) <= 0.0 and distance < 5.0 * self._near:
            self._next += 1  # just missed it
            self._turning = True
            return self.command(robot_pose)
        if abs(bearing) > (_ALIGNED if self._turning else _ASTRAY):
            self._turning = True
            return clamp_twist(self.robot, 0.0, bearing / self._period)
        self._turning = False
        steer = 2.0 * math.sin(bearing) / distance * self.robot.max_speed
        return clamp_twist(self.robot, min(self.robot.max_speed, distance / self._period), steer)

    def _steps_needed(self, x: float, y: float, theta: float) -> int:
        """Twice the control steps that the way takes without disturbance."""
        seconds = 0.0
        for px, py in self._points.tolist():
            turn = abs(math.remainder(math.atan2(py - y, px - x) - theta, 2.0 * math.pi))
            seconds += math.hypot(px - x, py - y) / self.robot.max_speed
            seconds += turn / self.robot.max_turn_rate
            theta = math.atan2(py - y, px - x)
            x, y = px, py
        return 2 * math.ceil(seconds / self._period) + 2 * _PATIENCE

    def _blocked(self, x: float, y: float, theta: float) -> bool:
        """Whether the robot has hardly moved since the last few calls."""
        if self._last is not None:
            x0, y0, theta0 = self._last
            moved = math.hypot(x - x0, y - y0) / self.robot.max_speed
            moved += abs(math.remainder(theta - theta0, 2.0 * math.pi)) / self.robot.max_turn_rate
            stalled = moved < _STALLED * self._period
            self._stalled = self._stalled + 1 if stalled else 0
        self._last = (x, y, theta)
        return self._stalled >= _PATIENCE
