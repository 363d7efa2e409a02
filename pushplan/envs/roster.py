"""The objects of an episode's start, some of which may have left the floor."""

from __future__ import annotations

import numpy as np

from pushplan.envs.trace import Trace
from pushplan.world import Movables
from pushplan.world.checks import IntArray, frozen


class Roster:
    """The objects of the start, some of which may have left the floor."""

    def __init__(self, movables: Movables) -> None:
        self.present: IntArray = movables.ids
        self._poses = np.array(movables.poses)
        self._before = self._poses
        self._masses = movables.masses
        self._rows = np.arange(len(movables))
        self._ids = movables.ids

    def widen(self, trace: Trace) -> Trace:
        """The trace of all objects of the start; one that has left keeps its last pose."""
        if len(self.present) == len(self._ids):
            self._poses = trace.object_poses[-1]
            return trace
        poses = np.repeat(self._poses[None], len(trace.times), axis=0)
        poses[:, self._rows] = trace.object_poses
        self._poses = poses[-1]
        return Trace(trace.times, trace.robot_poses, frozen(poses))

    def drop(self, ids: IntArray) -> None:
        """Objects have left the floor."""
        self._rows = self._rows[~np.isin(self.present, ids)]
        self.present = self._ids[self._rows]

    def work(self, trace: Trace) -> float:
        """Mass times path length [kg m] since the last call."""
        lengths = trace.object_lengths(self._before)
        self._before = self._poses
        return float(self._masses @ lengths)
