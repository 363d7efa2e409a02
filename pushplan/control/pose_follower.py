"""`PoseFollower`: a path pose by pose, one velocity at a time."""

from __future__ import annotations

import math

from pushplan.control.limits import arc_twist
from pushplan.control.progress_checker import ProgressChecker, StallChecker, decrease_by
from pushplan.world import RobotModel, Twist, World
from pushplan.world.checks import FloatArray, array, expect

_PATIENCE = 3.0
"""Time that may pass without getting on, in times that a step takes at full speed."""
_PROGRESS = 0.01  # by which a robot that gets on comes nearer to a pose [circumscribed radii]
_REACHED = 0.3  # of a step may be left when the next one begins, so that it does not slow down


class PoseFollower:
    """Drives along poses that are a step of the path apart, ahead or back.

    Args:
        robot: its limits.
        poses: (N, 3) where to go.
        response: time in which an error is driven off [s].
    """

    def __init__(self, robot: RobotModel, poses: FloatArray, response: float) -> None:
        self._robot = expect("robot", robot, RobotModel)
        self._poses: FloatArray = array("poses", poses, (None, 3))
        self._response = response
        self._next = 1
        self._stall = StallChecker(robot)
        self._progress: ProgressChecker[float] | None = None

    def drive(self, world: World, held: float) -> Twist | None:
        """`command` for where and when the robot is in a world."""
        return self.command(world.robot_pose, world.time, held)

    def command(self, pose: FloatArray, time: float, held: float) -> Twist | None:
        """The velocity to drive now; None when it is there, or does not get there.

        Args:
            pose: (3,) of the robot.
            time: [s].
            held: for how long the command will be held [s].
        """
        robot = self._robot
        size = self._robot.circumscribed_radius
        if self._stall.update(pose, time):
            return None
        seconds = max(held, self._response)
        while self._next < len(self._poses):
            before = self._poses[self._next - 1]
            target = self._poses[self._next]
            c = math.cos(float(pose[2]))
            s = math.sin(float(pose[2]))
            dx, dy = (float(value) for value in target[:2] - pose[:2])
            ahead = c * dx + s * dy
            aside = c * dy - s * dx
            turn = math.remainder(float(target[2] - pose[2]), math.tau)
            moves = float(c * (target[0] - before[0]) + s * (target[1] - before[1]))
            turns = abs(float(target[2] - before[2]))
            off = size * abs(turn)
            if moves:
                off = ahead * math.copysign(1.0, moves)
            if self._progress is None:
                lasts = abs(moves) / robot.max_speed + turns / robot.max_turn_rate
                patience = _PATIENCE * max(lasts, 2.0 * seconds)
                self._progress = ProgressChecker(decrease_by(_PROGRESS * size), patience)
            reached = off < _REACHED * (abs(moves) + size * turns)
            if reached or not self._progress.update(off, time):
                self._next += 1
                self._progress = None
                continue
            if moves:
                turn += (aside / size) * math.copysign(1.0, ahead)
            command = arc_twist(robot, ahead, turn, seconds)
            self._stall.send(command)
            return command
        return None
