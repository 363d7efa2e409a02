"""Plans of an episode, thinned out: what a policy meant to do, beside what happened."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray
from pushplan.world.plan import Plan

_POSES = 48  # of a path, at most
_PLANS = 2000  # of an episode, at most; beyond them every second one is kept, then every fourth
_MOVED = 1e-3  # objects that a plan expects to move by less are left out [m], [rad]


def thinned(count: int, most: int) -> IntArray:
    """Indices of at most ``most`` of so many things, evenly spaced, first and last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


@dataclass(frozen=True, eq=False)
class RecordedPlans(ArrayRecord, CheckedFields):
    """Paths that were planned, and where the objects were expected at their ends.

    Args:
        times: (P,) when each plan was taken up [s], not decreasing.
        offsets: (P + 1,) where the path of each plan starts in ``paths``.
        paths: (N, 3) x, y [m], theta [rad] of the robot, every path thinned out.
        moved_offsets: (P + 1,) where each plan starts in ``moved``.
        moved: (M,) indices of the objects that are expected to move, in the order of the episode.
        moved_poses: (M, 3) where they are expected at the end of the plan.

    Raises:
        InvalidInputError: if shapes, offsets or indices disagree, or a value is not finite.
    """

    field_prefix = "plans."

    times: Annotated[FloatArray, Shape(None)]
    offsets: Annotated[IntArray, Shape(None)]
    paths: Annotated[FloatArray, Shape("N", 3)]
    moved_offsets: Annotated[IntArray, Shape(None)]
    moved: Annotated[IntArray, Shape("M")]
    moved_poses: Annotated[FloatArray, Shape("M", 3)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if (np.diff(self.times) < 0.0).any():
            raise InvalidInputError("plans.times must not decrease")
        for name, total in (("offsets", len(self.paths)), ("moved_offsets", len(self.moved))):
            offsets = getattr(self, name)
            count = len(self) + 1
            rises = len(offsets) == count and not (np.diff(offsets, prepend=0) < 0).any()
            if not rises or (offsets[0], offsets[-1]) != (0, total):
                raise InvalidInputError(
                    f"plans.{name} must be {count} numbers that rise from 0 to {total}"
                )
        if (self.moved < 0).any():
            raise InvalidInputError("plans.moved must hold indices of objects, got a negative one")

    def __len__(self) -> int:
        return len(self.times)

    def path(self, index: int) -> FloatArray:
        """(N, 3) poses of one plan."""
        return self.paths[self.offsets[index] : self.offsets[index + 1]]

    def expected(self, index: int) -> tuple[IntArray, FloatArray]:
        """Indices (M,) of the objects that one plan moves, and where it leaves them (M, 3)."""
        part = slice(self.moved_offsets[index], self.moved_offsets[index + 1])
        return self.moved[part], self.moved_poses[part]


class PlanRecorder:
    """Keeps plans as they are taken up, of each no more than `RecordedPlans` needs.

    Args:
        ids: (K,) of the episode's objects, in its order.
    """

    def __init__(self, ids: IntArray) -> None:
        self._places = {int(one): k for k, one in enumerate(ids)}
        self._last: Plan | None = None
        self._seen = 0
        self._stride = 1
        self._kept: list[tuple[float, FloatArray, IntArray, FloatArray]] = []
        """When each plan was taken up, its path, the objects that move, and their poses."""

    def note(self, time: float, ids: IntArray, plan: Plan | None) -> None:
        """Note the plan that is driven now; the same one as before, or none, adds nothing.

        Args:
            time: now [s].
            ids: of the objects that are there, in the order of the plan's prediction.
            plan: it.
        """
        if plan is self._last:
            return
        self._last = plan
        if plan is None:
            return
        self._seen += 1
        if (self._seen - 1) % self._stride:
            return
        kept = thinned(len(plan.poses), _POSES)
        self._kept.append((time, plan.poses[kept], *self._prediction(ids, plan)))
        if len(self._kept) > _PLANS:
            self._stride *= 2
            del self._kept[1::2]

    def _prediction(self, ids: IntArray, plan: Plan) -> tuple[IntArray, FloatArray]:
        predicted = plan.object_poses
        if predicted is None or predicted.shape[1] != len(ids):
            return np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        far = np.abs(predicted[-1] - predicted[0]).max(axis=1, initial=0.0) > _MOVED
        chosen = [k for k in np.flatnonzero(far).tolist() if int(ids[k]) in self._places]
        places = np.array([self._places[int(ids[k])] for k in chosen], dtype=np.int64)
        return places, predicted[-1][chosen]

    def recorded(self) -> RecordedPlans:
        """Return the plans that were noted so far."""
        none = np.zeros((0, 3))
        start = 0.0, none, np.zeros(0, dtype=np.int64), none  # so that there is one to join
        times, paths, moved, poses = zip(start, *self._kept, strict=True)
        return RecordedPlans(
            times=np.array(times[1:]),
            offsets=np.cumsum([*map(len, paths)]),
            paths=np.concatenate(paths),
            moved_offsets=np.cumsum([*map(len, moved)]),
            moved=np.concatenate(moved),
            moved_poses=np.concatenate(poses),
        )
