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
        target: id of the object that it begins at.
        controller: how the robot drives, as in `PushPrimitive`: ``"line"`` straight ahead,
            ``"path"`` so that the target follows ``object_path``, ``"arc"`` along ``poses``
            themselves, ahead, back and on the spot.
        poses: (N, 3) the robot's path, from the start of the push on.
        length: of that path [m].
        work: sum of mass times path length over all objects [kg m].
        cost: what it costs in metres of the robot's path, work and remaining paths included [m].
        object_poses: (K, 3) where the objects are predicted to end.
        object_path: (M, 2) of the target object [m].
        shift: how far the robot's middle is to the left of the target object [m].
        gain: of the pushing controller, see `PushingController`.
        relocates: whether it only brings its target to where it can be pushed from, or nearer home.
    """

    delivers: tuple[int, ...]
    target: int
    controller: str
    poses: FloatArray
    length: float
    work: float
    cost: float
    object_poses: FloatArray
    object_path: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    shift: float = 0.0
    gain: float = 1.5
    relocates: bool = False

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
    if push.controller == "arc":
        return push.target, push.controller, round(heading / 0.6)
    return push.target, push.controller, round(heading / 0.3), round(push.shift, 2), push.gain
