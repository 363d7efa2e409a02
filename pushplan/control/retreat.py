"""`Retreat`: get away from where the robot is stuck."""

from __future__ import annotations

import math
from collections.abc import Callable

from pushplan.control.limits import clamp_twist
from pushplan.control.progress_checker import StallChecker
from pushplan.world import RobotModel, Twist
from pushplan.world.checks import FloatArray

_WAYS = ((-1.0, 0.0), (-0.5, 1.0), (-0.5, -1.0), (1.0, 0.0), (0.5, 1.0), (0.5, -1.0))
"""Speed and turn rate, as fractions of the greatest, that are tried in turn."""
_PATIENCE = 0.5  # time after which another way is tried where something stops the robot [s]
_TURNED = 1.0  # a turn by more is as good as the distance [rad]
_FREED = 0.03  # a way that has moved the robot by less has not freed it [circumscribed radii]


class Retreat:
    """Drives straight back, or whichever way is free, until the robot has got away.

    Args:
        robot: its limits; a differential drive.
        pose: (3,) where it is stuck.
        distance: to get away by [m]; half a turn left or right is as good.
        skip: how many ways to leave to the end, because they have not helped before.
        is_closed: says of a pose (3,) and a way whether that is known to lead into something;
            nothing is known if None, and a way is tried until something stops the robot.
    """

    def __init__(
        self,
        robot: RobotModel,
        pose: FloatArray,
        distance: float,
        skip: int = 0,
        is_closed: Callable[[FloatArray, Twist], bool] | None = None,
    ) -> None:
        self._robot = robot
        self._distance = distance
        self._from = self._tried_from = pose
        self._is_closed = is_closed or (lambda pose, way: False)
        skip %= len(_WAYS)
        commands = (
            clamp_twist(robot, speed * robot.max_speed, turn * robot.max_turn_rate)
            for speed, turn in (*_WAYS[skip:], *_WAYS[:skip])
        )
        self._ways = [way for way in commands if way.linear or way.angular]
        self._stall = StallChecker(robot, _PATIENCE)
        self.got_away = False
        """True once the robot has retreated by the distance."""

    def command(self, pose: FloatArray, time: float, held: float) -> Twist | None:
        """The velocity to drive now; None when it has got away, or there is no way.

        Args:
            pose: (3,) of the robot.
            time: [s].
            held: for how long the command will be held [s].
        """
        turned = abs(math.remainder(float(pose[2] - self._from[2]), math.tau))
        if math.dist(pose[:2], self._from[:2]) >= self._distance or turned > _TURNED:
            self._ways = []
            self.got_away = True
        stopped = bool(self._ways) and self._stall.update(pose, time)
        while self._ways and (stopped or self._is_closed(pose, self._ways[0])):
            self._give_up_way(pose)
            self._stall.reset()
            self._stall.update(pose, time)
            stopped = False
        if not self._ways:
            return None
        self._stall.send(self._ways[0])
        return self._ways[0]

    def _give_up_way(self, pose: FloatArray) -> None:
        """Take the next way; straight back once more if the last one has freed the robot."""
        size = self._robot.circumscribed_radius
        tried = self._ways.pop(0)
        if math.dist(pose[:2], self._tried_from[:2]) > _FREED * size and self._ways:
            back = clamp_twist(self._robot, -self._robot.max_speed, 0.0)
            if back.linear and tried != back:
                self._ways.insert(0, back)
        self._tried_from = pose
