"""`PushPath`: the path that a box is to be pushed along."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import motion as core
from pushplan.world import InvalidInputError, Plan, RobotModel, SubTask
from pushplan.world.checks import ArrayRecord, FloatArray, array, expect, integer, number
from pushplan.world.polyline import arc_lengths, step_lengths

_TURN_FRACTION = 0.8
"""Fraction of the greatest turn rate that a plan uses."""
_PIECES = 24  # least number of poses along a path of one piece
_GREATEST_TURN = 0.05  # greatest turn between two poses [rad]


@dataclass(frozen=True, eq=False)
class PushPath(ArrayRecord):
    """The path of a box's centre.

    Args:
        poses: (N, 3) x, y [m] and direction of travel [rad], at least two; how the box itself is
            turned does not matter.

    Raises:
        InvalidInputError: if there are fewer than two poses, or the path has no length.
    """

    poses: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "poses", array("push path poses", self.poses, (None, 3)))
        if len(self.poses) < 2 or self.length <= 0.0:
            raise InvalidInputError("a push path needs two poses or more, at different places")

    @classmethod
    def straight(cls, start: ArrayLike, end: ArrayLike) -> PushPath:
        """From one point (2,) to another [m]."""
        return cls.through(np.stack([array("start", start, (2,)), array("end", end, (2,))]))

    @classmethod
    def arcs(cls, start: ArrayLike, pieces: Sequence[tuple[float, float]]) -> PushPath:
        """Arcs, one after the other.

        Args:
            start: (3,) x, y [m] and direction [rad].
            pieces: length [m] and curvature [1/m], left positive, of each.
        """
        poses: list[FloatArray] = [array("start", start, (3,)).copy()]
        rows = array("pieces", pieces, (None, 2)).tolist()
        for i, (length, curvature) in enumerate(rows):
            length = number(f"pieces[{i}] length", length, low=0.0, open_low=True)
            turn = abs(curvature) * length
            count = min(max(_PIECES, math.ceil(turn / _GREATEST_TURN)), 2000)
            for _ in range(count):
                out = np.empty(3)
                core.along_arc(poses[-1], length / count, curvature, out)
                poses.append(out)
        return cls(np.array(poses))

    @classmethod
    def through(cls, points: ArrayLike, radius: float = 0.0) -> PushPath:
        """Straight from point to point.

        Args:
            points: (N, 2) [m], at least two.
            radius: of the arcs that round the corners [m]; less where a leg is too short.
        """
        corners: FloatArray = array("points", points, (None, 2))
        radius = number("radius", radius, low=0.0)
        if len(corners) > 1:
            corners = corners[np.concatenate([[True], step_lengths(corners) > 1e-9])]
        if len(corners) < 2:
            raise InvalidInputError("a push path needs two different points or more")
        legs = np.diff(corners, axis=0)
        lengths = np.hypot(legs[:, 0], legs[:, 1])
        headings = np.arctan2(legs[:, 1], legs[:, 0])
        cut = np.zeros(len(corners))  # of the legs beside each corner
        turns = _turns(headings)
        for i, turn in enumerate(turns.tolist(), start=1):
            if radius > 0.0 and 1e-6 < abs(turn) < math.pi - 1e-6:
                most = 0.5 * min(lengths[i - 1], lengths[i])
                cut[i] = min(radius * math.tan(0.5 * abs(turn)), most)
        poses: list[FloatArray] = []
        for i, (length, heading) in enumerate(zip(lengths, headings, strict=True)):
            ahead = np.array([math.cos(heading), math.sin(heading)])
            run = np.linspace(cut[i], length - cut[i + 1], _PIECES // 2 + 1)
            poses += [np.array([*(corners[i] + x * ahead), heading]) for x in run]
            if cut[i + 1] > 0.0:
                turn = float(turns[i])
                curvature = math.tan(0.5 * abs(turn)) / cut[i + 1]
                arc = cls.arcs(poses[-1], [(abs(turn) / curvature, math.copysign(curvature, turn))])
                poses += list(arc.poses[1:-1])
        return cls(np.array(poses))

    @property
    def lengths(self) -> FloatArray:
        """(N,) length of the path up to each pose [m]."""
        return arc_lengths(self.poses)

    @property
    def length(self) -> float:
        """[m]."""
        return float(self.lengths[-1])

    def plan(self, robot: RobotModel, box_id: int, speed: float | None = None) -> Plan:
        """The path as a `pushplan.world.Plan` for `PushingMpc`.

        Its poses are those of the box, and its one sub-task names the box. It is slower where the
        path turns faster than the robot can, with something left over for the controller.

        Args:
            robot: gives the speed limit.
            box_id: label of the box.
            speed: of the robot [m/s]; its greatest if None.
        """
        expect("robot", robot, RobotModel)
        speed_limit = robot.max_speed
        if speed is not None:
            speed_limit = min(speed_limit, number("speed", speed, low=0.0, open_low=True))
        count = len(self.poses)
        lengths = self.lengths
        turns = _turns(self.poses[:, 2])
        steps = np.maximum(np.diff(lengths), 1e-9)
        curvatures = turns / steps
        fastest = _TURN_FRACTION * robot.max_turn_rate / np.maximum(np.abs(curvatures), 1e-9)
        speeds = np.minimum(speed_limit, fastest)
        return Plan(
            times=np.concatenate([[0.0], np.cumsum(steps / speeds)]),
            poses=self.poses,
            speeds=np.append(speeds, speeds[-1]),
            turn_rates=np.append(speeds * curvatures, 0.0),
            travel_cost=robot.mass * float(lengths[-1]),
            subtasks=(SubTask((integer("box_id", box_id),), 0, count - 1),),
        )


def _turns(headings: FloatArray) -> FloatArray:
    """(N - 1,) turns between headings (N,), the shorter way [rad]."""
    return np.array([math.remainder(turn, math.tau) for turn in np.diff(headings).tolist()])
