"""`RolloutCache`: rollouts kept from plan to plan while nothing around them has moved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.world import Movables
from pushplan.world.checks import BoolArray, FloatArray, IntArray

_PLANS_KEPT = 8  # for how many plans what is not asked for is kept

Primitive = tuple[FloatArray, float, dict[int, FloatArray]]
"""Poses (N, 3) of the robot in a relocation, the cost of what it leaves to be done [m], and poses
(3,) of the objects, by id, that the route to it has moved."""


@dataclass(frozen=True, eq=False)
class Rollout:
    """Result of a simulated push.

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
    rollout: Rollout
    box: FloatArray
    near: IntArray
    """Ids of the objects that took part, or might have."""
    before: FloatArray
    """Their poses then."""
    moved: IntArray
    """Indices in ``near`` of those that were moved."""
    age: int = 0


class Asked(NamedTuple):
    """Key of a search for relocations of an object: everything that it depends on."""

    around: bytes  # Objects near it, and where they are
    robot: bytes  # About where the robot is
    thorough: bool


class RolloutCache:
    """Rollouts of the plans before, by what was rolled out.

    A rollout counts again if the same objects lie in the same places wherever it came near one.

    Attributes:
        searches: how often drives have been searched for the plan in hand.
        push_s: time that a first push with its approach takes, nearly at most [s].
    """

    def __init__(self) -> None:
        self._entries: dict[object, _Entry] = {}
        self._relocations: dict[int, tuple[Asked, list[Primitive]]] = {}
        self.searches = 0
        self.push_s = 0.0

    def relocations(self, target: int, asked: Asked) -> list[Primitive] | None:
        """Drives found for an object, if that was with the same around it.

        That there are none counts only for the robot in the same place: it may get to others. What
        a thorough search has found counts for every other one too.
        """
        known, found = self._relocations.get(target, (None, []))
        if known is None or known.around != asked.around or asked.thorough > known.thorough:
            return None
        return found if found or known.robot == asked.robot else None

    def keep_relocations(self, target: int, asked: Asked, found: list[Primitive]) -> None:
        """Keep the drives found for an object."""
        self._relocations[target] = asked, found
        self.searches += 1

    def is_from_elsewhere(self, robot: bytes) -> bool:
        """Return True if drives were searched when the robot was in another place."""
        return any(known.robot != robot for known, _ in self._relocations.values())

    def __len__(self) -> int:
        return len(self._entries)

    def age(self) -> None:
        """Forget what has not been asked for in the last few plans; another plan begins."""
        self.searches = 0
        for entry in self._entries.values():
            entry.age += 1
        self._entries = {
            key: entry for key, entry in self._entries.items() if entry.age < _PLANS_KEPT
        }

    def find(self, key: object, movables: Movables, poses: FloatArray) -> Rollout | None:
        """The rollout with a key of objects at poses (K, 3), if it would come to the same now."""
        entry = self._entries.get(key)
        if entry is None:
            return None
        near = np.flatnonzero(_within(entry.box, poses, movables.radii))
        if not np.array_equal(movables.ids[near], entry.near):
            return None
        if (poses[near] != entry.before).any():
            return None
        entry.age = 0
        old = entry.rollout
        moved = near[entry.moved]
        after = np.repeat(poses[None], len(old.steps), axis=0)
        lengths = np.zeros(after.shape[:2])
        after[:, moved] = old.poses
        lengths[:, moved] = old.lengths
        gone = after[:, :, 0] >= 0.5 * core.REMOVED
        after[:, :, 0] = np.where(
            gone, core.REMOVED * (1.0 + np.arange(len(poses))), after[:, :, 0]
        )
        return Rollout(old.track, old.steps, after, lengths)

    def keep(
        self, key: object, movables: Movables, poses: FloatArray, rollout: Rollout, box: FloatArray
    ) -> None:
        """Keep a rollout.

        Args:
            key: what was rolled out.
            movables: the objects.
            poses: (K, 3) where they were.
            rollout: what it came to.
            box: (4,) of what moved, and its surroundings [m].
        """
        box = box.copy()
        near = np.flatnonzero(_grown(box, poses, movables.radii))
        moved = np.flatnonzero((rollout.poses[:, near] != poses[near]).any(axis=(0, 2)))
        which = near[moved]
        kept = Rollout(
            rollout.track, rollout.steps, rollout.poses[:, which], rollout.lengths[:, which]
        )
        self._entries[key] = _Entry(kept, box, movables.ids[near], poses[near], moved)


def _within(box: FloatArray, poses: FloatArray, radii: FloatArray) -> BoolArray:
    """(K,) which objects reach into a box."""
    places = poses[:, :2]
    reach = radii[:, None]
    inside = (places + reach > box[:2]) & (places - reach < box[2:])  # (K, 2)
    return inside[:, 0] & inside[:, 1]


def _grown(box: FloatArray, poses: FloatArray, radii: FloatArray) -> BoolArray:
    """Make a box big enough for what reaches into it: a jam may go on from object to object."""
    within = np.zeros(len(poses), dtype=np.bool_)
    while True:
        now = _within(box, poses, radii)
        if (now == within).all():
            return within
        within = now
        places = poses[within, :2]
        reach = 1.1 * radii[within, None]
        box[:2] = np.minimum(box[:2], (places - reach).min(axis=0))
        box[2:] = np.maximum(box[2:], (places + reach).max(axis=0))
