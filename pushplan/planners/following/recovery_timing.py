"""When a robot that follows plans recovers, and how long it waits where no plan is found."""

from __future__ import annotations

import math

from pushplan.control import PoseProgressChecker, Recovery
from pushplan.world import Drive, RobotModel, Twist, World

_DISTANCE = 1.0  # by which a recovery takes the robot away [circumscribed radii]
_PLACE = 2.0  # recoveries that are no farther apart are at the same place [circumscribed radii]
_MOST_RECOVERIES = 6  # recoveries at one place
_HERE = 0.5  # size of a place where calls find nothing [circumscribed radii]
_MOST_DOUBLINGS = 5


class RecoveryRule:
    """Begins a recovery where the robot does not get on, each time in another way at one place.

    A robot that has recovered as often as there are ways, and is still at the same place, is
    `stuck`: it stays with its plans alone until they bring it elsewhere. A constant-speed robot
    cannot recover, nor can a car that does not reverse.

    Args:
        world: at the start of the episode.
    """

    def __init__(self, world: World) -> None:
        self._checker = PoseProgressChecker(world.robot)
        self._recovery: Recovery | None = None
        self._place = world.robot_pose
        self._count = 0
        self._told = 0.0
        self._held = math.inf

    @property
    def idle(self) -> float:
        """Time for which the robot has not got on [s]."""
        return self._checker.idle

    @property
    def patience(self) -> float:
        """Time without getting on after which a recovery begins [s]."""
        return self._checker.patience

    @property
    def stuck(self) -> bool:
        """True if all recoveries at this place are used up."""
        return self._count >= _MOST_RECOVERIES

    @property
    def is_on(self) -> bool:
        """True while a recovery is in progress."""
        return self._recovery is not None

    def wait(self) -> None:
        """Take it that the robot stands because it has to: that is no lack of progress."""
        self._checker.reset()

    def command(self, world: World, held: float) -> Twist | None:
        """The velocity of a recovery; None where there is none, or it has just ended.

        Args:
            world: the scene now.
            held: for how long the last command was held [s]. Where that is more than twice as
                long as before, the rule was not asked meanwhile, and the rest is nobody's delay.
        """
        self._told += min(held, 2.0 * self._held)
        self._held = held
        size = world.robot.circumscribed_radius
        if math.dist(world.robot_pose[:2], self._place[:2]) > _PLACE * size:
            self._place = world.robot_pose
            self._count = 0
        gets_on = self._checker.update(world.robot_pose, self._told)
        if self._recovery is None:
            if gets_on or self.stuck or not _can_back_off(world.robot):
                return None
            self._recovery = Recovery(world, _DISTANCE * size, skip=self._count)
            self._count += 1
        command = self._recovery.command(world, held)
        if command is None:
            self._recovery = None
            self._checker.reset()
        return command


def _can_back_off(robot: RobotModel) -> bool:
    if robot.drive is Drive.CAR:
        return robot.min_speed < 0.0
    return robot.drive is Drive.DIFFERENTIAL


class FruitlessCalls:
    """Counts the calls that found nothing since the robot is where it is."""

    def __init__(self) -> None:
        self._count = 0
        self._place = (math.nan, math.nan)

    def add(self, world: World) -> None:
        """Another call from here has found nothing."""
        self._count = 1 + self.count(world)
        if self._count == 1:
            x, y, _ = world.robot_pose.tolist()
            self._place = x, y

    def clear(self) -> None:
        """A call has found a plan."""
        self._count = 0

    def count(self, world: World) -> int:
        """Number of calls in a row that have found no plan since the robot is at this place."""
        away = math.dist(world.robot_pose[:2].tolist(), self._place)
        if away <= _HERE * world.robot.circumscribed_radius:
            return self._count
        return 0

    def delay(self, world: World) -> float:
        """Factor of the time before the next call; planners without randomness search the same."""
        return 2.0 ** min(max(self.count(world) - 1, 0), _MOST_DOUBLINGS)
