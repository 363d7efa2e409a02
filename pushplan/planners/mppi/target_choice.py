"""`TargetChoice`: which object the robot is drawn behind, and when it gives it up."""

from __future__ import annotations

import math

import numpy as np

from pushplan.geometry import Path
from pushplan.planners.mppi.approach_grid import Approach, approach_to, place_behind
from pushplan.planners.mppi.fields import CLEARANCE, object_ways
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.world import World
from pushplan.world.checks import FloatArray

_GAIN = 0.25  # by how much the way has to get shorter to count as progress [R]
_PUSHED = 3.0  # weight of a metre of the object, relative to one of the robot


class TargetChoice:
    """Keeps to one object until it is done, or until nothing is gained any more.

    The next one is the nearest that can be got behind, of those that were given up least often.

    Args:
        config: settings.
    """

    def __init__(self, config: MppiConfig) -> None:
        self.config = config
        self._target = -1
        self._failures: dict[int, int] = {}
        self._best = math.inf
        self._since = 0.0

    def approach(self, world: World) -> Approach | None:
        """The way to behind the object that is to be pushed now; None if there is none."""
        movables = world.movables
        completed = world.completed
        ids = movables.ids.tolist()
        left = [k for k in range(len(ids)) if not completed[k]]
        if not left:
            return None
        if self._target in ids and ids.index(self._target) in left:
            k = ids.index(self._target)
            place = self._behind(world, k)
            if place is not None and self._gets_on(world, k, place):
                return approach_to(world, self.config, k, place)
            self._failures[self._target] = self._failures.get(self._target, 0) + 1
        found = {k: place for k in left if (place := self._behind(world, k)) is not None}
        if not found:
            return None
        k = min(
            found, key=lambda k: (self._failures.get(ids[k], 0), _way(world, k, found[k]), ids[k])
        )
        self._target = ids[k]
        self._best = math.inf
        self._since = world.time
        return approach_to(world, self.config, k, found[k])

    def _behind(self, world: World, k: int) -> FloatArray | None:
        """(3,) pose behind an object on its way to the goal; None if there is no way."""
        movables = world.movables
        robot = world.robot
        points = _way_of_object(world, k).points
        steps = np.hypot(*(points - points[:1]).T)
        ahead = np.flatnonzero(steps > 0.02 * robot.circumscribed_radius)
        if not len(ahead):
            return None
        dx, dy = points[ahead[0]] - points[0]
        failed = self._failures.get(int(movables.ids[k]), 0)
        return place_behind(world, k, math.atan2(dy, dx), failed)

    def _gets_on(self, world: World, k: int, place: FloatArray) -> bool:
        """Return True if the paths to the object and of the object have become shorter lately."""
        robot = world.robot
        size = robot.circumscribed_radius
        now = _way(world, k, place) + _PUSHED * _way_of_object(world, k).length
        if now < self._best - _GAIN * size:
            self._best = now
            self._since = world.time
        return world.time - self._since < self.config.patience * size / robot.max_speed


def _way_of_object(world: World, k: int) -> Path:
    """The way of an object to where it is done."""
    radius = float(world.movables.radii[k])
    ways = object_ways(world.static, world.area_goal, radius, CLEARANCE * radius)
    return ways.path_from(world.movables.poses[k, :2])


def _way(world: World, k: int, place: FloatArray) -> float:
    """About how far the robot drives to a pose behind an object, around it [m]."""
    x, y, _ = world.robot_pose.tolist()
    way = math.hypot(x - place[0], y - place[1])
    ox, oy = world.movables.poses[k, :2].tolist()
    in_front = (x - ox) * math.cos(place[2]) + (y - oy) * math.sin(place[2])
    around = math.hypot(place[0] - ox, place[1] - oy)
    return way + (around if in_front > 0.0 else 0.0)
