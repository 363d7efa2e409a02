"""`Push`: one candidate push, with what it is predicted to do."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pushplan.world.checks import ArrayRecord, FloatArray


@dataclass(frozen=True, eq=False)
class Push(ArrayRecord):
    """A push, from a place behind an object to where nothing is left to be done with it.

    Args:
        delivers: ids of the objects that are done by it.
        target: id of the object that follows a path, or that a line push begins behind.
        follows_path: whether it follows ``object_path``; else the robot drives straight ahead.
        poses: (N, 3) the robot's path, from the start of the push on.
        length: of that path [m].
        work: sum of mass times path length over all objects [kg m].
        cost: what it costs in metres of the robot's path, work and remaining paths included [m].
        object_poses: (K, 3) where the objects are predicted to end.
        object_path: (M, 2) of the target object [m].
        shift: how far the robot's middle is to the left of the target object [m].
        gain: of the pushing controller, see `PushingController`.
        pre_relocates: whether it only brings the object to where it can be pushed from.
        is_primitive: whether it is an extraction primitive: the robot follows ``poses`` themselves,
            ahead, back and on the spot.
    """

    delivers: tuple[int, ...]
    target: int
    follows_path: bool
    poses: FloatArray
    length: float
    work: float
    cost: float
    object_poses: FloatArray
    object_path: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    shift: float = 0.0
    gain: float = 1.5
    pre_relocates: bool = False
    is_primitive: bool = False

    @property
    def serves(self) -> tuple[int, ...]:
        """Ids of the objects that it does something for: those done, or its target."""
        return self.delivers or (self.target,)

    @property
    def start(self) -> FloatArray:
        """(3,) where the push begins."""
        start: FloatArray = self.poses[0]
        return start

    @property
    def end(self) -> FloatArray:
        """(3,) where it ends."""
        end: FloatArray = self.poses[-1]
        return end


def signature(push: Push) -> tuple[object, ...]:
    """What a push is known by when it has failed."""
    heading = math.remainder(float(push.start[2]), 2.0 * math.pi)
    if push.is_primitive:
        return push.target, push.is_primitive, round(heading / 0.6)
    return push.target, push.follows_path, round(heading / 0.3), round(push.shift, 2), push.gain
