"""Finding one's place on a plan."""

from __future__ import annotations

import numpy as np

from pushplan.world import Plan
from pushplan.world.checks import FloatArray


class Progress:
    """How far along a plan the robot is; never jumps to another branch of the same path.

    Args:
        window: how far ahead along the path the nearest point is looked for [m].
    """

    def __init__(self, window: float) -> None:
        self.window = window
        self._plan: Plan | None = None
        self._lengths: FloatArray = np.zeros(1)
        self.along = 0.0
        """Path length from the beginning of the plan to the nearest point [m]."""

    def update(self, plan: Plan, x: float, y: float) -> float:
        """Move on to the point of ``plan`` nearest to (x, y) [m]; returns `along`."""
        if plan is not self._plan:
            self._plan = plan
            self._lengths = plan.arc_lengths
            self.along = 0.0
        lengths, points = self._lengths, plan.poses[:, :2]
        first = max(0, int(np.searchsorted(lengths, self.along, side="right")) - 1)
        last = min(int(np.searchsorted(lengths, self.along + self.window)) + 1, len(points) - 1)
        if last <= first:
            return self.along
        a, b = points[first:last], points[first + 1 : last + 1]
        edge = b - a
        square = np.maximum((edge * edge).sum(axis=1), 1e-18)
        fraction = np.clip((([x, y] - a) * edge).sum(axis=1) / square, 0.0, 1.0)
        foot = a + fraction[:, None] * edge
        gaps = np.hypot(foot[:, 0] - x, foot[:, 1] - y)
        best = int(np.argmin(gaps))
        here = lengths[first + best] + fraction[best] * (
            lengths[first + best + 1] - lengths[first + best]
        )
        self.along = max(self.along, float(here))
        return self.along

    @property
    def total(self) -> float:
        """Length of the plan [m]."""
        return float(self._lengths[-1])

    def index(self, along: float) -> int:
        """Index of the last pose at or before path length ``along`` [m]."""
        at = int(np.searchsorted(self._lengths, along + 1e-12, side="right")) - 1
        return min(max(at, 0), len(self._lengths) - 1)

    def pose(self, along: float) -> FloatArray:
        """(3,) pose of the plan at path length ``along`` [m], headings taken the short way."""
        assert self._plan is not None
        i = self.index(along)
        poses = self._plan.poses
        if i == len(poses) - 1:
            last: FloatArray = poses[i]
            return last
        length = self._lengths[i + 1] - self._lengths[i]
        fraction = (along - self._lengths[i]) / length if length > 0.0 else 0.0
        turn = (poses[i + 1, 2] - poses[i, 2] + np.pi) % (2.0 * np.pi) - np.pi
        change = np.array([*(poses[i + 1, :2] - poses[i, :2]), turn])
        pose: FloatArray = poses[i] + min(fraction, 1.0) * change
        return pose
