"""`Push`: one candidate sub-task, with what it is predicted to do."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pushplan.world.checks import ArrayRecord, FloatArray


@dataclass(frozen=True, eq=False)
class Push(ArrayRecord):
    """A push, from a place behind an object to where nothing is left to be done with it.

    Args:
        covers: ids of the objects that are done by it.
        led: id of the object that is led, or that a line push begins behind.
        guided: whether the object is led along ``box_path``; else the robot drives straight ahead.
        poses: (N, 3) the robot's path, from the start of the push on.
        length: of that path [m].
        work: sum of mass times path length over all objects [kg m].
        price: what it costs in metres of the robot's path, work and remaining ways included [m].
        object_poses: (K, 3) where the objects are predicted to end.
        box_path: (M, 2) of the led object [m].
        shift: how far the robot's middle is to the left of the led object [m].
        gain: of the pushing law, see `Law`.
        frees: whether it only brings the object to where it can be pushed from.
        traced: whether the robot follows ``poses`` themselves, ahead, back and on the spot, as in
            a maneuver.
    """

    covers: tuple[int, ...]
    led: int
    guided: bool
    poses: FloatArray
    length: float
    work: float
    price: float
    object_poses: FloatArray
    box_path: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    shift: float = 0.0
    gain: float = 1.5
    frees: bool = False
    traced: bool = False

    @property
    def serves(self) -> tuple[int, ...]:
        """Ids of the objects that it does something for: those done, or the one that is freed."""
        return self.covers or (self.led,)

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
    if push.traced:
        return push.led, push.traced, round(heading / 0.6)
    return push.led, push.guided, round(heading / 0.3), round(push.shift, 2), push.gain
