"""`PoseFollower`: a path pose by pose, one velocity at a time."""

from __future__ import annotations

import math

from pushplan.control import clamp_twist
from pushplan.world import RobotModel, Twist
from pushplan.world.checks import FloatArray


class PoseFollower:
    """Drives a differential drive along poses that are a step of it apart, ahead or back.

    Args:
        robot: its limits.
        poses: (N, 3) where to go.
        period: time between two commands [s].
    """

    def __init__(self, robot: RobotModel, poses: FloatArray, period: float) -> None:
        self._robot, self._poses, self._period = robot, poses, period
        self._next, self._tries = 1, 0

    def command(self, pose: FloatArray) -> Twist | None:
        """The velocity to drive now; None when it is there, or does not get there."""
        robot, size = self._robot, self._robot.circumscribed_radius
        while self._next < len(self._poses):
            before, target = self._poses[self._next - 1], self._poses[self._next]
            c, s = math.cos(float(pose[2])), math.sin(float(pose[2]))
            dx, dy = (float(value) for value in target[:2] - pose[:2])
            ahead, aside = c * dx + s * dy, c * dy - s * dx
            turn = math.remainder(float(target[2] - pose[2]), 2.0 * math.pi)
            moves = float(c * (target[0] - before[0]) + s * (target[1] - before[1]))
            step = abs(moves) + size * abs(float(target[2] - before[2]))
            off = ahead * math.copysign(1.0, moves) if moves else size * abs(turn)
            if off < 0.3 * step or self._tries > 8:
                self._next += 1
                self._tries = 0
                continue
            self._tries += 1
            turn += (aside / size) * math.copysign(1.0, ahead) if moves else 0.0
            return clamp_twist(robot, ahead / self._period, turn / self._period)
        return None
