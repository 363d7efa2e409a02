"""Progress checkers in metres and seconds, independent of the control rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import partial
from typing import Generic, TypeVar

from pushplan.world import RobotModel, Twist
from pushplan.world.checks import FloatArray, expect

_STALL_FRACTION = 0.1
"""A robot that moves less than this fraction of what it was told to is being stopped."""
_LEAST_TOLD = 0.1
"""Commanded motion below which nothing is concluded [circumscribed radii]."""
_MOVED = 0.25  # that counts as getting on [circumscribed radii], or [rad]
_TURN = 0.5  # for which a robot that gets on is given time [rad]
_SURE = 6.0  # standard deviations by which noise moves nothing
_RESPONSE = 0.5  # that delays and slow motors may take [s]

Seen = TypeVar("Seen")


class ProgressChecker(Generic[Seen]):
    """Watches whether something gets on, by any quantity that can be measured.

    Args:
        gets_on: returns True if the second measurement is progress since the first; see
            `decrease_by`.
        patience: time without progress that is allowed [s].

    Attributes:
        patience: the same.
        idle: time since the last progress [s].
    """

    def __init__(self, gets_on: Callable[[Seen, Seen], bool], patience: float) -> None:
        self._gets_on = gets_on
        self.patience = patience
        self.reset()

    def reset(self) -> None:
        """Begin anew, with another thing to do or after waiting for something."""
        self._last: Seen | None = None
        self.idle = 0.0

    def update(self, seen: Seen, time: float) -> bool:
        """Take what is measured at a time [s]; returns True while it gets on."""
        if self._last is None or self._gets_on(self._last, seen):
            self._last = copy(seen)  # an array may be written over by the caller
            self._since = time
        self.idle = time - self._since
        return self.idle <= self.patience


def decrease_by(least: float) -> Callable[[float, float], bool]:
    """Progress of a quantity that has to become less, each time by more than ``least``."""
    return partial(_is_less, least)


def _is_less(least: float, best: float, left: float) -> bool:
    return left < best - least


class PoseProgressChecker(ProgressChecker[FloatArray]):
    """Watches whether a robot gets away from where it was, whatever it is told to drive.

    Going by a quarter of the circumscribed radius, or turning by a quarter of a radian, is getting
    on: the `PoseProgressChecker` of Nav2, with a time that goes with the robot. Its patience is the
    time in which the robot could go by its radius, and turn.

    Args:
        robot: its size, speeds and accelerations.
        patience: another time without progress that is allowed [s].
        noise: standard deviations of what is seen, places [m] and headings [rad].
    """

    def __init__(
        self,
        robot: RobotModel,
        patience: float | None = None,
        noise: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        size = robot.circumscribed_radius
        self._distance = _MOVED * size + _SURE * noise[0]
        self._turn = _MOVED + _SURE * noise[1]
        going = size / robot.max_speed + robot.max_speed / robot.max_acceleration
        turning = _TURN / robot.max_turn_rate + robot.max_turn_rate / robot.max_turn_acceleration
        if patience is None:
            patience = going + turning + _RESPONSE
        super().__init__(self._has_moved, patience)

    def _has_moved(self, before: FloatArray, pose: FloatArray) -> bool:
        turn = math.remainder(float(pose[2] - before[2]), math.tau)
        return self.moved_by(math.dist(pose[:2], before[:2]), abs(turn)) >= 1.0

    def moved_by(self, distance: float, turn: float) -> float:
        """Size of a motion [m] and [rad], at least 1 if it counts as getting on."""
        return max(distance / self._distance, turn / self._turn)


class StallChecker:
    """Compares how far the robot has got with what it was told to drive.

    Turns count as the path of the robot's rim. The measure is net motion, so that noise in the
    pose does not add up to progress.

    Args:
        robot: whose size is the unit.
        patience: time that a stop has to last [s].
    """

    def __init__(self, robot: RobotModel, patience: float = 0.8) -> None:
        self._size = expect("robot", robot, RobotModel).circumscribed_radius
        self._patience = patience
        self.reset()

    def reset(self) -> None:
        """Begin anew, for instance after driving another way."""
        self._from: FloatArray | None = None
        self._since = self._time = self._told = 0.0
        self._command = Twist(0.0, 0.0)

    def update(self, pose: FloatArray, time: float) -> bool:
        """Take the pose (3,) at a time [s]; returns True if something stops the robot."""
        if self._from is not None:
            seconds = time - self._time
            self._told += seconds * self._path(self._command.course[0], self._command.angular)
        self._time = time
        if self._from is None:
            self._begin(pose, time)
            return False
        away = pose - self._from
        turn = math.remainder(float(away[2]), math.tau)
        moved = self._path(math.hypot(float(away[0]), float(away[1])), turn)
        told_enough = self._told >= _LEAST_TOLD * self._size
        if moved >= max(_STALL_FRACTION * self._told, _STALL_FRACTION * _LEAST_TOLD * self._size):
            if told_enough:
                self._begin(pose, time)
            return False
        return told_enough and time - self._since >= self._patience - 1e-9

    def send(self, command: Twist) -> None:
        """Take the command that is driven until the next call of `update`."""
        self._command = command

    def _begin(self, pose: FloatArray, time: float) -> None:
        self._from = pose.copy()
        self._since = time
        self._told = 0.0

    def _path(self, length: float, turn: float) -> float:
        return abs(length) + self._size * abs(turn)
