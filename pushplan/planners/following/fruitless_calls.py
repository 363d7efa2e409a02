"""`FruitlessCalls`: planning calls in a row that found no plan, at one place."""

from __future__ import annotations

import math

from pushplan.world import World

_PLACE = 0.5  # size of a place [circumscribed radii]
_MOST_DOUBLINGS = 5


class FruitlessCalls:
    """Counts the calls that found nothing since the robot is where it is."""

    def __init__(self) -> None:
        self._count, self._place = 0, (math.nan, math.nan)

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
        """How many calls in a row have found no plan since the robot is at this place."""
        away = math.dist(world.robot_pose[:2].tolist(), self._place)
        return self._count if away <= _PLACE * world.robot.circumscribed_radius else 0

    def delay(self, world: World) -> float:
        """Factor of the time before the next call; planners without randomness search the same."""
        return 2.0 ** min(max(self.count(world) - 1, 0), _MOST_DOUBLINGS)
