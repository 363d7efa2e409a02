"""Finding one's place on a plan."""

from __future__ import annotations

import math

import numpy as np

from pushplan.world import Plan, Stage
from pushplan.world.checks import FloatArray

_NEAR = 0.005  # length of a stage that may be left when the next one begins [windows]
_AWAY = 0.25  # a robot that is farther from where it turns has turned [windows]
ALIGNED = math.radians(2.0)
"""Heading error at which a turn on the spot is finished [rad]."""

_TURNED = 1e-3  # angle that may be left of a turn at the end of a plan [rad]


class Progress:
    """Position of the robot along its plan; never jumps to another branch of the same path.

    It goes from stage to stage (`pushplan.world.Plan.stages`): a robot that turns on the spot gets
    on in its heading, and where it goes back along the same path it does not get back before it
    has arrived.

    Args:
        window: how far ahead along the path the nearest point is looked for [m].
    """

    def __init__(self, window: float) -> None:
        self.window = window
        self._plan: Plan | None = None
        self._lengths: FloatArray = np.zeros(1)
        self._stages: tuple[Stage, ...] = (Stage(0, 0, 1),)
        self._at = 0
        self.along = 0.0
        """Path length from the beginning of the plan to the nearest point [m]."""
        self.turned = 0.0
        """Angle of the present turn on the spot that is made [rad]."""
        self.left_to_turn = 0.0
        """Angle of it that is left, the way that the plan turns [rad]."""

    def update(self, plan: Plan, pose: FloatArray) -> float:
        """Move on to the place on ``plan`` nearest to a pose (3,); returns `along`."""
        if plan is not self._plan:
            self._plan = plan
            self._lengths = plan.arc_lengths
            self._stages = plan.stages
            self._at = 0
            self.along = self.turned = 0.0
        while not self._get_on(plan, self.stage, pose) and not self.is_last:
            self._at += 1
            self.turned = 0.0
        return self.along

    @property
    def stage(self) -> Stage:
        """The present part of the plan."""
        return self._stages[self._at]

    @property
    def is_last(self) -> bool:
        """True if no other stage follows the present one."""
        return self._at == len(self._stages) - 1

    def _get_on(self, plan: Plan, stage: Stage, pose: FloatArray) -> bool:
        """Take up a pose on a stage; returns whether something of it is left."""
        x = float(pose[0])
        y = float(pose[1])
        if stage.direction:
            self._go_on(plan, stage, x, y)
            return bool(self.along < self._lengths[stage.last] - _NEAR * self.window)
        headings = self._headings()
        whole = float(headings[-1] - headings[0])
        side = math.copysign(1.0, whole)
        ahead = side * math.remainder(float(pose[2] - headings[0]) - side * self.turned, math.tau)
        self.turned = min(max(self.turned, self.turned + ahead), abs(whole))
        self.left_to_turn = abs(whole) - self.turned - min(ahead, 0.0)
        away = math.dist((x, y), plan.poses[stage.last, :2].tolist())
        return self.left_to_turn > ALIGNED and away < _AWAY * self.window

    def _go_on(self, plan: Plan, stage: Stage, x: float, y: float) -> None:
        """Move on to the point of a stage that is driven nearest to (x, y) [m]."""
        lengths = self._lengths
        points = plan.poses[:, :2]
        first = int(np.searchsorted(lengths, self.along, side="right")) - 1
        first = max(stage.first, first)
        last = int(np.searchsorted(lengths, self.along + self.window)) + 1
        last = min(last, stage.last)
        if last <= first:
            return
        a = points[first:last]
        b = points[first + 1 : last + 1]
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

    @property
    def total(self) -> float:
        """Length of the plan [m]."""
        return float(self._lengths[-1])

    @property
    def is_over(self) -> bool:
        """True if the robot is at the end of the plan, and has turned there as it says."""
        turns = self.stage.direction == 0 and self.left_to_turn > _TURNED
        return self.along >= self.total - 1e-9 and not turns

    @property
    def left_of_stage(self) -> float:
        """Path length that is left of the present stage [m]."""
        return float(self._lengths[self.stage.last]) - self.along

    @property
    def time(self) -> float:
        """Time of the plan at the present place [s]."""
        assert self._plan is not None
        first, last, direction = self.stage
        part = slice(first, last + 1)
        times = self._plan.times[part]
        if direction:
            return float(np.interp(self.along, self._lengths[part], times))
        return float(np.interp(self.turned, np.abs(self._headings() - self._headings()[0]), times))

    def _headings(self) -> FloatArray:
        """Headings of the poses of the present stage [rad], without jumps."""
        assert self._plan is not None
        first, last, _ = self.stage
        return np.unwrap(self._plan.poses[first : last + 1, 2])

    def index(self, along: float) -> int:
        """Index of the last pose of the present stage at or before path length ``along`` [m]."""
        first, last, direction = self.stage
        if direction == 0:
            turned = np.abs(self._headings() - self._headings()[0])
            return first + int(np.searchsorted(turned, self.turned + 1e-9, side="right")) - 1
        at = int(np.searchsorted(self._lengths, along + 1e-12, side="right")) - 1
        return min(max(at, first), last)

    def pose(self, along: float) -> FloatArray:
        """(3,) pose of the plan at path length ``along`` [m], headings taken the short way.

        Of a turn on the spot it is that where the robot is.
        """
        assert self._plan is not None
        i = self.index(along)
        poses = self._plan.poses
        if i == self.stage.last or not self.stage.direction:
            last: FloatArray = poses[i]
            return last
        length = self._lengths[i + 1] - self._lengths[i]
        fraction = (along - self._lengths[i]) / length if length > 0.0 else 0.0
        turn = (poses[i + 1, 2] - poses[i, 2] + np.pi) % (2.0 * np.pi) - np.pi
        change = np.array([*(poses[i + 1, :2] - poses[i, :2]), turn])
        pose: FloatArray = poses[i] + min(fraction, 1.0) * change
        return pose
