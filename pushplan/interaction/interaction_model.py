"""The one question every planner asks: what would driving this path do to the objects?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

from numpy.typing import ArrayLike

from pushplan.world import InvalidInputError, World
from pushplan.world.checked_fields import CheckedFields, Limits, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, array
from pushplan.world.polyline import path_lengths
from pushplan.world.protocols import HasAttributes


def checked_path(path: ArrayLike) -> FloatArray:
    """Poses (N, 3) that a robot is swept through.

    Raises:
        InvalidInputError: if the path is not (N, 3), empty, or not finite.
    """
    poses: FloatArray = array("path", path, (None, 3))
    if len(poses) == 0:
        raise InvalidInputError("path must hold at least one pose, got none")
    return poses


@dataclass(frozen=True, eq=False)
class Interaction(ArrayRecord, CheckedFields):
    """Predicted effect of sweeping the robot along a path of N poses among K objects.

    Args:
        object_poses: (N, K, 3) x, y [m], theta [rad] of each object when the robot is at each
            pose of the path; the first entry is the start.
        masses: (K,) masses of the objects [kg].
        jammed_at: index of the first pose that the robot cannot reach, because it or what it
            pushes is held by something static; -1 if it reaches them all. Objects rest where they
            were from there on.
    """

    field_prefix = "interaction."

    object_poses: Annotated[FloatArray, Shape(None, "K", 3)]
    masses: Annotated[FloatArray, Shape("K")]
    jammed_at: Annotated[int, Limits(-1)] = -1

    @property
    def lengths(self) -> FloatArray:
        """(K,) path length of each object's centre [m], not its displacement."""
        return path_lengths(self.object_poses)

    @property
    def work(self) -> float:
        """Sum over the objects of mass times path length [kg m]: what the metrics measure."""
        return float(self.masses @ self.lengths)


@runtime_checkable
class InteractionModel(HasAttributes, Protocol):
    """Predicts what happens to the objects when the robot sweeps along a path."""

    def sweep(self, world: World, path: ArrayLike) -> Interaction:
        """Predict the motion of every object.

        Args:
            world: the snapshot from which the robot starts; it is not changed.
            path: (N, 3) robot poses x, y [m], theta [rad], close enough together that the
                straight line between two of them is what the robot drives, and the turn from one to
                the next the shorter one.

        Raises:
            InvalidInputError: if the path is not (N, 3), empty, or not finite.
        """


@runtime_checkable
class SweepsMany(InteractionModel, Protocol):
    """A model that predicts several paths from one snapshot faster than one after the other."""

    def sweep_many(self, world: World, paths: Sequence[ArrayLike]) -> list[Interaction]:
        """Do as `sweep` for each of several paths, all from ``world``."""
