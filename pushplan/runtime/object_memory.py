"""`ObjectMemory`: objects that are out of sight for a while are still there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pushplan.world import Receptacle, World
from pushplan.world.goals import ClearanceArea


class ObjectMemory:
    """Adds to a snapshot the objects that it lacks and that were seen not long ago.

    They are where they were predicted to be. One that has come to where the goal wants it is not
    missed.

    Args:
        keep: for how long an object is kept that is not seen [s].
    """

    def __init__(self, keep: float) -> None:
        self._keep = keep
        self._seen_at: dict[int, float] = {}

    def complete(self, seen: World, predicted: World) -> World:
        """A snapshot with what it lacks.

        Args:
            seen: the snapshot.
            predicted: what the last one, completed, has become by then.
        """
        seen_at = dict.fromkeys(seen.movables.ids.tolist(), seen.time)
        if self._keep > 0.0:
            done = np.zeros(len(predicted.movables), dtype=np.bool_)
            if isinstance(predicted.goal, Receptacle | ClearanceArea):
                done = predicted.completed
            kept = []
            for k, label in enumerate(predicted.movables.ids.tolist()):
                at = self._seen_at.get(label, predicted.time)
                if label not in seen_at and not done[k] and seen.time - at <= self._keep:
                    seen_at[label] = at
                    kept.append(k)
            if kept:
                missed = predicted.movables.select(kept)
                seen = replace(seen, movables=seen.movables.updated(missed))
        self._seen_at = seen_at
        return seen
