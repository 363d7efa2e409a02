"""`Movability`: which objects can be moved, as told, as seen, and as felt."""

from __future__ import annotations

import math

import numpy as np

from pushplan.control import StallChecker
from pushplan.geometry import convex_penetration
from pushplan.world import RobotModel, Twist, World
from pushplan.world.checks import FloatArray, IntArray, expect, number

_TOUCH = 0.05  # gap at which the robot touches an object [circumscribed radii]
_AGAINST = 0.3  # cosine of the greatest angle between the heading and what is in the way
_MOVED = 0.05  # motion that proves that an object can be moved [circumscribed radii]
_SURE = 8.5  # standard deviations of a position by which one that was seen has to change
_PATIENCE = 1.0  # time for which an object has to stop the robot [s]


class Movability:
    """Belief about which objects of one episode can be moved.

    An object is held not to move where the world says so, until that leaves no way
    (`drop_prior`), or where it has stopped the robot that drove against it, which is the evidence;
    an object that has been seen to move can be moved.

    Args:
        robot: that pushes.
        position_noise: standard deviation of the positions that are seen [m].
    """

    def __init__(self, robot: RobotModel, position_noise: float = 0.0) -> None:
        self._size = expect("robot", robot, RobotModel).circumscribed_radius
        noise = number("position_noise", position_noise, low=0.0)
        self._motion = max(_MOVED * self._size, _SURE * noise)
        self._first: dict[int, FloatArray] = {}
        self._stall = StallChecker(robot, _PATIENCE)
        self._ahead = False
        self._has_prior = True
        self._believed: tuple[float, set[int]] | None = None
        self.stopped_by: set[int] = set()
        """Ids of the objects that have stopped the robot."""
        self.seen_moving: set[int] = set()
        """Ids of the objects that have moved."""

    def update(self, world: World) -> World:
        """The scene as it is believed to be now; the same belief at the same time."""
        expect("world", world, World)
        if self._believed is None or world.time != self._believed[0]:
            self._believed = world.time, self._believe(world)
        fixed = np.isin(world.movables.ids, list(self._believed[1]))
        if np.array_equal(fixed, world.movables.fixed):
            return world
        return world.believing(fixed)

    def _believe(self, world: World) -> set[int]:
        """Ids of the objects that are held not to move now, after what is seen."""
        objects = world.movables
        for label, pose in zip(objects.ids.tolist(), objects.poses, strict=True):
            first = self._first.setdefault(label, pose)
            if math.dist(pose[:2], first[:2]) > self._motion:
                self.seen_moving.add(label)
        if self._stall.update(world.robot_pose, world.time) and self._ahead:
            self.stopped_by |= self._touched(world)
        self.stopped_by -= self.seen_moving
        believed = set(self.stopped_by)
        if self._has_prior:
            believed |= set(objects.ids[objects.fixed].tolist()) - self.seen_moving
        return believed

    def send(self, command: Twist) -> None:
        """Take the command that is driven until the next update."""
        expect("command", command, Twist)
        ahead = command.linear > 0.0
        if ahead != self._ahead:  # what has stopped it before was in its way elsewhere
            self._ahead = ahead
            self._stall.reset()
        self._stall.send(command)

    def known(self, ids: IntArray) -> list[str]:
        """Of each object with ids (K,): ``"movable"``, ``"fixed"``, or ``"unknown"`` by now."""
        found = []
        for label in ids.tolist():
            state = "fixed" if label in self.stopped_by else "unknown"
            found.append("movable" if label in self.seen_moving else state)
        return found

    def drop_prior(self) -> None:
        """Stop believing what was told, where nothing else is left to try."""
        self._has_prior = False

    def _touched(self, world: World) -> set[int]:
        """Ids of the objects that are in the way of the robot, which drives ahead."""
        found: set[int] = set()
        touch = _TOUCH * self._size
        heading = np.array([math.cos(world.robot_pose[2]), math.sin(world.robot_pose[2])])
        parts = [np.ascontiguousarray(part) for part in world.robot_outline_world()]
        moved = [part + touch * heading for part in parts]
        for k, label in enumerate(world.movables.ids.tolist()):
            outlines = [np.ascontiguousarray(part) for part in world.movables.parts_world(k)]
            for old, new in zip(parts, moved, strict=True):
                for outline in outlines:
                    into = convex_penetration(new, outline)[0]
                    nearer = into - convex_penetration(old, outline)[0]
                    if into > 0.0 and nearer > _AGAINST * touch:
                        found.add(label)
        return found
