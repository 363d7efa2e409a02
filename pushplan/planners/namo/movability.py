"""`Movability`: which objects can be moved, as told, as seen, and as felt."""

from __future__ import annotations

import math

import numpy as np

from pushplan.control import StallChecker
from pushplan.geometry import convex_distance
from pushplan.world import Twist, World
from pushplan.world.checks import FloatArray

_TOUCH = 0.05  # gap at which the robot touches an object [circumscribed radii]
_MOVED = 0.05  # motion that proves that an object can be moved [circumscribed radii]
_PATIENCE = 2.0  # time for which an object has to stop the robot [s]


class Movability:
    """What is believed of the objects of one episode.

    An object is held not to move where the world says so, until that leaves no way (`doubt`), or
    where it has stopped the robot that drove against it, which is the evidence; an object that
    has been seen to move can be moved.

    Args:
        world: the start of the episode.
    """

    def __init__(self, world: World) -> None:
        self._size = world.robot.circumscribed_radius
        self._first: dict[int, FloatArray] = {}
        self._stall = StallChecker(world.robot, _PATIENCE)
        self._ahead = False
        self._doubted = False
        self.stopped_by: set[int] = set()
        """Ids of the objects that have stopped the robot."""
        self.seen_moving: set[int] = set()
        """Ids of the objects that have moved."""

    def update(self, world: World) -> World:
        """The scene as it is believed to be now."""
        objects = world.movables
        for number, pose in zip(objects.ids.tolist(), objects.poses, strict=True):
            first = self._first.setdefault(number, pose)
            if math.dist(pose[:2], first[:2]) > _MOVED * self._size:
                self.seen_moving.add(number)
        if self._stall.update(world.robot_pose, world.time) and self._ahead:
            self.stopped_by |= self._touched(world) - self.seen_moving
        self.stopped_by -= self.seen_moving
        fixed = [
            number in self.stopped_by
            or (bool(told) and not self._doubted and number not in self.seen_moving)
            for number, told in zip(objects.ids.tolist(), objects.fixed, strict=True)
        ]
        if fixed == objects.fixed.tolist():
            return world
        return world.believing(fixed)

    def send(self, command: Twist) -> None:
        """Take the command that is driven until the next update."""
        self._ahead = command.linear > 0.0
        self._stall.send(command)

    def doubt(self) -> None:
        """Stop believing what was told, where nothing else is left to try."""
        self._doubted = True

    def _touched(self, world: World) -> set[int]:
        """Ids of the objects that touch the robot ahead of its middle."""
        found: set[int] = set()
        heading = np.array([math.cos(world.robot_pose[2]), math.sin(world.robot_pose[2])])
        for k, number in enumerate(world.movables.ids.tolist()):
            outline = np.ascontiguousarray(world.movables.outline_world(k))
            ahead = float(((outline - world.robot_pose[:2]) @ heading).max()) > 0.0
            gap = min(
                convex_distance(np.ascontiguousarray(part), outline)
                for part in world.robot_outline_world()
            )
            if ahead and gap < _TOUCH * self._size:
                found.add(number)
        return found
