"""`Recall`: what pushes came to, kept from plan to plan while nothing around them has moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.compiled import kernel
from pushplan.planners.rearrangement.rollout import GONE, enclose
from pushplan.world import Movables
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_OLD = 8
"""For how many plans what is not asked for is kept."""


Drive = tuple[FloatArray, float]
"""Poses (N, 3) of the robot in a maneuver, and what it leaves to be done [m]."""


@dataclass(frozen=True, eq=False)
class Run:
    """What a push came to.

    Args:
        track: (T, 3) the robot's poses.
        steps: (S,) how many poses each stage has.
        poses: (S, K, 3) the objects' poses at the end of each stage.
        lengths: (S, K) their path lengths [m].
    """

    track: FloatArray
    steps: IntArray
    poses: FloatArray
    lengths: FloatArray


@dataclass(eq=False)
class _Entry:
    run: Run
    box: FloatArray
    near: IntArray
    """Ids of the objects that took part, or might have."""
    before: FloatArray
    """Their poses then."""
    moved: IntArray
    """Which of them were moved."""
    age: int = 0


class Recall:
    """Runs of the plan before, by what was run.

    A run counts again if the same objects lie in the same places wherever it came near one.

    Attributes:
        searches: how often maneuvers have been looked for since something was done.
    """

    def __init__(self) -> None:
        self._entries: dict[object, _Entry] = {}
        self._drives: dict[int, tuple[bytes, list[Drive]]] = {}
        self.searches = 0

    def drives(self, led: int, around: bytes) -> list[Drive] | None:
        """Maneuvers found for an object, if that was with the same around it."""
        known = self._drives.get(led)
        return known[1] if known is not None and known[0] == around else None

    def keep_drives(self, led: int, around: bytes, found: list[Drive]) -> None:
        """Keep the maneuvers found for an object."""
        self._drives[led] = around, found
        self.searches += 1

    def __len__(self) -> int:
        return len(self._entries)

    def age(self) -> None:
        """Forget what has not been asked for in the last few plans."""
        for entry in self._entries.values():
            entry.age += 1
        self._entries = {key: entry for key, entry in self._entries.items() if entry.age < _OLD}

    def find(self, key: object, movables: Movables, poses: FloatArray) -> Run | None:
        """The run with a key, if it would come to the same now.

        Args:
            key: what was run.
            movables: the objects.
            poses: (K, 3) where they are.
        """
        entry = self._entries.get(key)
        if entry is None:
            return None
        near = np.flatnonzero(_within(entry.box, poses, movables.radii))
        if not np.array_equal(movables.ids[near], entry.near):
            return None
        if (poses[near] != entry.before).any():
            return None
        entry.age = 0
        old, moved = entry.run, near[entry.moved]
        after = np.repeat(poses[None], len(old.steps), axis=0)
        lengths = np.zeros(after.shape[:2])
        after[:, moved], lengths[:, moved] = old.poses, old.lengths
        gone = after[:, :, 0] >= 0.5 * GONE
        after[:, :, 0] = np.where(gone, GONE * (1.0 + np.arange(len(poses))), after[:, :, 0])
        return Run(old.track, old.steps, after, lengths)

    def keep(
        self, key: object, movables: Movables, poses: FloatArray, run: Run, box: FloatArray
    ) -> None:
        """Keep a run.

        Args:
            key: what was run.
            movables: the objects.
            poses: (K, 3) where they were.
            run: what it came to.
            box: (4,) of what moved, and its surroundings [m].
        """
        near = np.flatnonzero(_grown(box, poses, movables.radii))
        moved = np.flatnonzero((run.poses[:, near] != poses[near]).any(axis=(0, 2)))
        kept = Run(run.track, run.steps, run.poses[:, near[moved]], run.lengths[:, near[moved]])
        self._entries[key] = _Entry(kept, box.copy(), movables.ids[near], poses[near], moved)


@kernel(allocates=True)
def _within(box: FloatArray, poses: FloatArray, radii: FloatArray) -> BoolArray:
    """(K,) which objects reach into a box."""
    within = np.empty(len(poses), dtype=np.bool_)
    for k in range(len(poses)):
        x, y, r = poses[k, 0], poses[k, 1], radii[k]
        within[k] = x + r > box[0] and x - r < box[2] and y + r > box[1] and y - r < box[3]
    return within


@kernel(allocates=True)
def _grown(box: FloatArray, poses: FloatArray, radii: FloatArray) -> BoolArray:
    """Make a box big enough for what reaches into it: a jam may go on from object to object."""
    within = np.zeros(len(poses), dtype=np.bool_)
    while True:
        now = _within(box, poses, radii)
        if (now == within).all():
            return within
        within = now
        for k in range(len(poses)):
            if within[k]:
                enclose(box, poses[k], 1.1 * radii[k])
