"""`LegFollower`: straight legs ahead or back, with turns on the spot between them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pushplan.control.limits import clamp_twist
from pushplan.control.progress_checker import ProgressChecker, StallChecker, decrease_by
from pushplan.world import InvalidInputError, RobotModel, Twist
from pushplan.world.checks import ArrayRecord, FloatArray, array, number

_ASTRAY = math.radians(15.0)
"""Bearing at which a leg is interrupted to turn."""
_PASSED = 0.12
_BESIDE = 0.03
"""Distances at which a point that lies behind, or abeam, counts as reached [circumscribed radii]:
to turn for so little could sweep into something."""
_NEAR = 0.02  # distance at which a point is reached by default [circumscribed radii]
_STEERED_FROM = 8.0  # distance from which on the bearing of a point is steered by [`near`]
_PROGRESS = 0.01  # by which a robot that gets on comes nearer to a point [circumscribed radii]
_TURNS_IN = 0.8
"""A robot whose middle is this near to a wall makes room by the rest of its circumscribed radius
before it turns [inscribed radii]."""
LITTLE_TURN = 0.6
"""A turn by less is not made the longer way [rad]."""
_PATIENCE = 2.0
"""Time without getting on after which a leg is given up, or a turn is good enough [s]."""


@dataclass(frozen=True, eq=False)
class Legs(ArrayRecord):
    """Legs of a path that is driven straight, with turns on the spot between them.

    Args:
        points: (N, 2) where each leg ends [m], world frame.
        signs: (N,) 1 ahead, -1 back.
        turns: (N + 1,) how to turn on the spot before each leg, and at the end: 1 to the left, -1
            to the right, 0 the shorter way.
        heading: to turn to at the end [rad]; None for any.
    """

    points: FloatArray
    signs: FloatArray
    turns: FloatArray
    heading: float | None

    @staticmethod
    def ahead(points: ArrayLike, heading: float | None = None) -> Legs:
        """Legs that are driven forwards.

        Args:
            points: (N, 2) where each ends [m], without the start.
            heading: see `Legs`.

        Raises:
            InvalidInputError: if there is no point, or one is not finite.
        """
        found: FloatArray = array("points", points, (None, 2))
        if len(found) == 0:
            raise InvalidInputError("points must hold at least one point")
        return Legs(found, np.ones(len(found)), np.zeros(len(found) + 1), heading)


class LegFollower:
    """Turns to each point in turn, drives there, and turns to a heading at the end.

    It bears noise and delay: nothing in it depends on how often it is called. It ends when it has
    arrived, when something stops the robot, or when it does not get on.

    Args:
        robot: its limits; a differential drive.
        legs: where to go.
        near: distance at which a point is reached [m]; 0.02 circumscribed radii if None.
        aligned: error of a heading that is left [rad].
        response: time in which an error of heading or place is driven off [s]; longer than the
            robot's delay.
        escapes: how often it may make room for a turn that something stops.

    Attributes:
        arrived: True when it stands at the end.
        steady: for how long the last command stays right if the robot follows it exactly [s].
    """

    def __init__(
        self,
        robot: RobotModel,
        legs: Legs,
        *,
        near: float | None = None,
        aligned: float = math.radians(2.0),
        response: float = 0.2,
        escapes: int = 0,
    ) -> None:
        self._robot = robot
        self._legs = legs
        size = robot.circumscribed_radius
        near = _NEAR * size if near is None else near
        self._near = number("near", near, low=0.0, open_low=True)
        self._aligned = number("aligned", aligned, low=0.0, open_low=True)
        self._response = number("response", response, low=0.0, open_low=True)
        self._escapes = escapes
        self._stall = StallChecker(robot)
        self._progress = ProgressChecker(decrease_by(_PROGRESS * size), _PATIENCE)
        self._aiming = ProgressChecker(decrease_by(0.5 * self._aligned), _PATIENCE)
        self._next = 0
        self._away: list[tuple[float, float]] = []
        self._take_up()
        self.arrived = False
        self.steady = 0.0

    def _take_up(self) -> None:
        """Begin a leg with its turn."""
        self._turning = True
        self._turned_at = math.inf
        self._progress.reset()
        self._aiming.reset()

    def skip(self) -> None:
        """Leave out the rest of the present leg."""
        self._next += 1
        self._take_up()
        self._stall.reset()

    def command(
        self, pose: FloatArray, time: float, held: float, *, stopped: bool = False
    ) -> Twist | None:
        """The velocity to drive now; None when it is there or has given up.

        Args:
            pose: (3,) x, y [m], theta [rad] of the robot now.
            time: [s].
            held: for how long the command will be held [s].
            stopped: something is known to stop the robot.

        Raises:
            InvalidInputError: if the pose is not finite.
        """
        pose = array("robot_pose", pose, (3,))
        stopped = self._stall.update(pose, time) or stopped
        command = self._make_room(pose, time, held, stopped)
        if command is None:
            if stopped:
                return None
            command = self._drive(pose, time, max(held, self._response))
        if command is not None:
            self._stall.send(command)
        return command

    def _drive(self, pose: FloatArray, time: float, seconds: float) -> Twist | None:
        robot = self._robot
        legs = self._legs
        while self._next < len(legs.points):
            sign = float(legs.signs[self._next])
            if sign < 0.0 and robot.min_speed == 0.0:
                sign = 1.0  # it cannot drive back
            dx, dy = (float(value) for value in legs.points[self._next] - pose[:2])
            distance = math.hypot(dx, dy)
            turn = float(legs.turns[self._next]) if self._turning else 0.0
            bearing = turn_to(float(pose[2]), math.atan2(sign * dy, sign * dx), turn)
            if self._is_reached(distance, abs(bearing)):
                self._next += 1
                self._take_up()
                continue
            misses = distance * math.sin(min(abs(bearing), 0.5 * math.pi)) > self._near
            astray = abs(bearing) > _ASTRAY and misses
            wrong = abs(bearing) > self._aligned if self._turning else astray
            if wrong and not self._is_aimed(abs(bearing), time):
                if not self._turning:
                    if distance > self._turned_at - self._near:
                        return None  # turning again has brought it no nearer
                    self._turned_at = distance
                    self._aiming.reset()
                self._turning = True
                return self._turn(bearing, seconds)
            self._turning = False
            if not self._progress.update(distance, time):
                return None
            return self._straight(sign, distance, bearing, seconds)
        if legs.heading is not None:
            error = turn_to(float(pose[2]), legs.heading, float(legs.turns[-1]))
            if abs(error) > self._aligned and not self._is_aimed(abs(error), time):
                return self._turn(error, seconds)
        self.arrived = True
        return None

    def _is_reached(self, distance: float, bearing: float) -> bool:
        """Return True if a leg is over, by the distance and the bearing to its end."""
        size = self._robot.circumscribed_radius
        behind = not self._turning and bearing > 0.5 * math.pi
        passed = behind and distance < max(_PASSED * size, 3.0 * self._near)
        beside = bearing > _ASTRAY and distance < max(_BESIDE * size, 1.5 * self._near)
        return distance <= self._near or passed or beside

    def _is_aimed(self, error: float, time: float) -> bool:
        """Return True if a turn comes no nearer to its heading, and is near enough."""
        return not self._aiming.update(error, time) and error < _ASTRAY

    def _turn(self, error: float, seconds: float) -> Twist:
        robot = self._robot
        self._progress.reset()
        self.steady = abs(error) / robot.max_turn_rate
        return clamp_twist(robot, 0.0, error / seconds)

    def _straight(self, sign: float, distance: float, bearing: float, seconds: float) -> Twist:
        """Drive at the point, as fast as the turn that is still to be made allows."""
        robot = self._robot
        fastest = robot.max_speed if sign > 0.0 else -robot.min_speed
        if bearing != 0.0:
            fastest = min(fastest, 0.5 * robot.max_turn_rate * distance / abs(math.sin(bearing)))
        speed = min(fastest, distance / seconds)
        self.steady = distance / fastest if abs(bearing) < 1e-6 else 0.0
        # near the point its bearing says little
        turn = min(1.0, distance / (_STEERED_FROM * self._near)) * bearing / seconds
        return clamp_twist(robot, sign * speed, turn)

    def _make_room(self, pose: FloatArray, time: float, held: float, stopped: bool) -> Twist | None:
        """Move away by as much as a turn that is stopped takes, back or else ahead."""
        robot = self._robot
        if self._away and stopped:  # not this way
            self._away.pop(0)
            self._room_from = pose
        elif stopped and self._turning and self._escapes and not self._away:
            self._escapes -= 1
            room = robot.circumscribed_radius - _TURNS_IN * robot.inscribed_radius
            self._away = [(robot.min_speed, room)] if robot.min_speed < 0.0 else []
            self._away += [(robot.max_speed, room)]
            self._room_from = pose
        if not self._away:
            return None
        if stopped:
            self._stall.reset()
            self._stall.update(pose, time)
        speed, room = self._away[0]
        left = room - math.dist(pose[:2], self._room_from[:2])
        if left <= 1e-3 * robot.circumscribed_radius:
            self._away = []
            self._take_up()
            return None
        self.steady = left / abs(speed)
        return clamp_twist(robot, math.copysign(min(left / held, abs(speed)), speed), 0.0)


def turn_to(heading: float, to: float, turn: float) -> float:
    """The turn [rad] that is still to be made from one heading to another, the way it is meant.

    Args:
        heading: [rad].
        to: [rad].
        turn: as in `Legs`; the last bit of a turn is made the shorter way in any case.
    """
    left = math.remainder(to - heading, math.tau)
    if left * turn < 0.0 and abs(left) > 0.5 * LITTLE_TURN:
        left += math.copysign(math.tau, turn)
    return left
