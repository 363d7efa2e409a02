"""Goals as unions of convex regions: the nearest point of each, and where their outlines cross."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pushplan.core import geometry as core
from pushplan.world import (
    ClearanceArea,
    Goal,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    ObjectGoals,
    Receptacle,
)
from pushplan.world.checks import ArrayRecord, BoolArray, FloatArray, array
from pushplan.world.outline import convex_outline, flatten


@dataclass(frozen=True, eq=False)
class Polygons(ArrayRecord):
    """Convex polygons (N, 2) and segments (2, 2) [m], any of which is to be reached."""

    parts: tuple[FloatArray, ...]


Target = Goal | Polygons


def as_target(goal: Goal | Sequence[ArrayLike]) -> Target:
    """Check what distances are asked to.

    Args:
        goal: a goal, or convex polygons (N, 2) and segments (2, 2) [m].

    Raises:
        InvalidInputError: if it is neither, or there is nothing in the list.
    """
    if isinstance(goal, Goal):
        return goal
    if isinstance(goal, str | np.ndarray) or not isinstance(goal, Sequence) or not len(goal):
        raise InvalidInputError(
            "distances are measured to a GoalDisc, GoalLine, Receptacle, ClearanceArea or "
            f"ObjectGoals, or to a list of convex polygons and segments, got {type(goal).__name__}"
        )
    parts = []
    for i, part in enumerate(goal):
        points: FloatArray = array(f"targets[{i}]", part, (None, 2))
        if len(points) != 2:  # of two points it is a segment
            points = convex_outline(f"targets[{i}]", points)
        parts.append(points)
    return Polygons(tuple(parts))


def regions_of(target: Target, *, to_center: bool = False) -> core.Regions:
    """The regions of a checked target; ``to_center`` shrinks a disc to its centre.

    Those of a clearance area are its open edges, see `outside_area`; those of `ObjectGoals` the
    discs of all its places.
    """
    discs = np.zeros((0, 3))
    lines = np.zeros((0, 4))
    parts: tuple[FloatArray, ...] = ()
    if isinstance(target, GoalDisc):
        discs = np.array([[*target.center, 0.0 if to_center else target.radius]])
    elif isinstance(target, GoalLine):
        lines = np.array([[*target.point, *target.normal]])
    elif isinstance(target, ObjectGoals):
        radii = np.zeros(len(target.ids)) if to_center else target.radii
        discs = np.column_stack([target.poses[:, :2], radii])
    elif isinstance(target, Receptacle):
        parts = (target.polygon,)
    elif isinstance(target, ClearanceArea):
        edges = np.stack([target.polygon, np.roll(target.polygon, -1, axis=0)], axis=1)
        parts = tuple(edges[target.open_edges])
    else:
        parts = target.parts
    corners, offsets = flatten(parts)
    return core.Regions(discs, lines, corners, offsets)


def outside_area(target: Target, points: FloatArray) -> BoolArray:
    """Check which points (..., 2) [m] lie outside a clearance area; none for other targets.

    They are at the goal already. A way through the outside is no way for a point inside: only the
    open edges count for it.
    """
    outside = np.zeros(points.shape[:-1], dtype=np.bool_)
    if isinstance(target, ClearanceArea):
        along = np.roll(target.polygon, -1, axis=0) - target.polygon
        for corner, edge in zip(target.polygon, along, strict=True):
            offset = points - corner
            outside |= edge[0] * offset[..., 1] - edge[1] * offset[..., 0] < 0.0
    return outside
