"""Poses recorded while a simulator ran."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.world.checks import ArrayRecord, FloatArray, frozen


@dataclass(frozen=True, eq=False)
class Trace(ArrayRecord):
    """Motion of robot and objects during a stretch of time, without the instant at which it began.

    Traces of consecutive stretches therefore join end to end without a repeated instant.

    Args:
        times: (N,) [s], increasing.
        robot_poses: (N, 3) x, y [m], theta [rad].
        object_poses: (N, K, 3) in the order of the world's movables.
    """

    times: FloatArray
    robot_poses: FloatArray
    object_poses: FloatArray

    @classmethod
    def join(cls, traces: Sequence[Trace]) -> Trace:
        """One trace of several consecutive ones; at least one is needed."""
        if len(traces) == 1:
            return traces[0]
        return cls(
            times=frozen(np.concatenate([trace.times for trace in traces])),
            robot_poses=frozen(np.concatenate([trace.robot_poses for trace in traces])),
            object_poses=frozen(np.concatenate([trace.object_poses for trace in traces])),
        )

    def object_lengths(self, start: FloatArray) -> FloatArray:
        """(K,) path length of each object's centre [m] from its pose in ``start`` (K, 3) on."""
        points = np.concatenate([start[None, :, :2], self.object_poses[:, :, :2]])
        steps = np.diff(points, axis=0)
        lengths: FloatArray = np.sqrt((steps * steps).sum(axis=-1)).sum(axis=0)
        return lengths
