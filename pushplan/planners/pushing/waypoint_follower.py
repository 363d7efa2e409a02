"""`WaypointFollower`: drive along a polyline to a pose, by poses that may be off."""

from __future__ import annotations

import math

from pushplan.control import clamp_twist
from pushplan.world import RobotModel, Twist
from pushplan.world.checks import FloatArray

_ASTRAY = math.radians(25.0)  # bearing at which the robot stops to turn
_STEADY = 0.4
"""Least distance that steering reckons with [circumscribed radii]: nearer points are noise."""
_ROOM = 0.5  # how far it backs off where it cannot turn [circumscribed radii]
_ESCAPES = 2
_BEST = 0.02  # what counts as getting on [circumscribed radii, rad]


class WaypointFollower:
    """Turns to each point of a polyline, drives there, and turns to a heading at the end.

    `pushplan.control.DriveTo` is more exact where poses are; this one bears noise and delays.

    Args:
        robot: its limits; a differential drive.
        points: (N, 2) where to go [m], in order; without the start.
        heading: at the end [rad].
        near: distance at which a point is reached [m].
        aligned: error of a heading that is left [rad].
        patience: time without getting on after which it gives up [s].
    """

    def __init__(
        self,
        robot: RobotModel,
        points: FloatArray,
        heading: float,
        *,
        near: float,
        aligned: float,
        patience: float,
    ) -> None:
        self._robot, self._points, self._heading = robot, points, heading
        self._near, self._aligned, self._patience = near, aligned, patience
        self._next, self._turning = 0, True
        self._best, self._since = math.inf, -math.inf
        self._away, self._escapes = 0.0, 0
        self.arrived = False
        """Whether it stands at the end."""

    def command(self, pose: FloatArray, time: float, period: float, held: bool) -> Twist | None:
        """The velocity to drive now, None when it is there or has given up.

        Args:
            pose: (3,) of the robot when the command takes effect.
            time: [s].
            period: for which the command is held [s].
            held: whether the last command could not be driven.
        """
        robot, size = self._robot, self._robot.circumscribed_radius
        if held and self._escapes >= _ESCAPES:
            return None
        if held:
            self._escapes += 1
            self._away = _ROOM * size if self._away == 0.0 and robot.min_speed < 0.0 else 0.0
        if self._away > 0.0:
            step = min(self._away, -robot.min_speed * period)
            self._away = max(self._away - step, 0.0)
            self._best = math.inf
            return clamp_twist(robot, -step / period, 0.0)
        x, y, theta = (float(value) for value in pose)
        while self._next < len(self._points):
            dx, dy = self._points[self._next, 0] - x, self._points[self._next, 1] - y
            distance = math.hypot(dx, dy)
            bearing = math.remainder(math.atan2(dy, dx) - theta, math.tau)
            passed = not self._turning and abs(bearing) > 0.5 * math.pi
            if distance > self._near and not (passed and distance < 0.3 * size):
                return self._on_the_way(distance, bearing, time, period)
            self._next += 1
            self._turning, self._best = False, math.inf
        error = math.remainder(self._heading - theta, math.tau)
        if abs(error) <= self._aligned:
            self.arrived = True
            return None
        if self._stalls(abs(error), time):
            return None
        return clamp_twist(robot, 0.0, error / (2.0 * period))

    def _on_the_way(
        self, distance: float, bearing: float, time: float, period: float
    ) -> Twist | None:
        robot, size = self._robot, self._robot.circumscribed_radius
        self._turning = abs(bearing) > (self._aligned if self._turning else _ASTRAY)
        left = distance / size + (abs(bearing) if self._turning else 0.0)
        if self._stalls(left, time):
            return None
        if self._turning:
            return clamp_twist(robot, 0.0, bearing / (1.5 * period))
        speed = min(robot.max_speed, distance / period)
        turn = 2.0 * math.sin(bearing) / max(distance, _STEADY * size) * speed
        return clamp_twist(robot, speed, turn)

    def _stalls(self, left: float, time: float) -> bool:
        """Whether what is left to do has not become less for long."""
        if left < self._best - _BEST:
            self._best, self._since = left, time
        return time - self._since > self._patience
