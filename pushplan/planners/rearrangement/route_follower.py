"""`RouteFollower`: the legs of a route, one velocity at a time."""

from __future__ import annotations

import math

from pushplan.control import clamp_twist
from pushplan.planners.rearrangement.route import Route, turn_to
from pushplan.world import RobotModel, Twist
from pushplan.world.checks import FloatArray

_ALIGNED = math.radians(0.4)
_ASTRAY = math.radians(15.0)
_NEAR = 0.004


class RouteFollower:
    """Drives a route of a differential drive.

    Args:
        robot: its limits.
        route: where to go.
        period: time between two commands [s].
    """

    def __init__(self, robot: RobotModel, route: Route, period: float) -> None:
        self._robot, self._route, self._period = robot, route, period
        self._next, self._turning = 0, True
        self._tries = 0

    def skip(self) -> None:
        """Leave out the rest of the present leg."""
        self._next += 1
        self._turning, self._tries = True, 0

    def command(self, pose: FloatArray) -> Twist | None:
        """The velocity to drive now; None when it is there."""
        robot, route, period = self._robot, self._route, self._period
        x, y, theta = (float(value) for value in pose)
        near = _NEAR * robot.circumscribed_radius
        while self._next < len(route.points):
            sign = float(route.signs[self._next])
            if sign < 0.0 and robot.min_speed == 0.0:
                sign = 1.0  # it cannot drive back
            dx, dy = route.points[self._next, 0] - x, route.points[self._next, 1] - y
            distance = math.hypot(dx, dy)
            bearing = turn_to(
                theta,
                math.atan2(sign * dy, sign * dx),
                float(route.turns[self._next]) if self._turning else 0.0,
            )
            passed = not self._turning and abs(bearing) > 0.5 * math.pi
            beside = abs(bearing) > _ASTRAY  # to turn for so little could sweep into something
            if (
                distance <= near
                or (beside and distance < 8.0 * near)
                or (passed and distance < 30.0 * near)
            ):
                self._next += 1
                self._turning, self._tries = True, 0
                continue
            if abs(bearing) > (_ALIGNED if self._turning else _ASTRAY) and self._tries < 80:
                self._turning = True
                self._tries += 1
                return clamp_twist(robot, 0.0, bearing / period)
            self._turning = False
            fastest = robot.max_speed if sign > 0.0 else -robot.min_speed
            speed = min(fastest, distance / period)
            return clamp_twist(
                robot, sign * speed, bearing / period if distance > 5 * near else 0.0
            )
        error = turn_to(theta, route.heading, float(route.turns[-1]))
        if abs(error) > _ALIGNED and self._tries < 80:
            self._tries += 1
            return clamp_twist(robot, 0.0, error / period)
        return None
