"""Goals as unions of convex regions: the nearest point of each, and where their outlines cross."""

from __future__ import annotations

import math
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
from pushplan.world.outline import convex_outline, flatten, unflatten


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


def region_crossings(regions: core.Regions, edges: FloatArray) -> FloatArray:
    """Points (N, 2) [m] where outlines of the regions cross segments (E, 4) [m].

    A shortest path to a region ends at the region's nearest point or, where an obstacle covers
    that, at one of these.
    """
    found = [np.zeros((0, 2))]
    if len(edges) == 0:
        return found[0]
    start = edges[:, :2]
    along = edges[:, 2:] - edges[:, :2]
    for cx, cy, radius in regions.discs.tolist():
        a = np.maximum((along**2).sum(axis=1), 1e-300)
        offset = start - np.array([cx, cy])
        b = (along * offset).sum(axis=1) / a
        square = b**2 - ((offset**2).sum(axis=1) - radius * radius) / a
        root = np.sqrt(np.maximum(square, 0.0))
        for t in (-b - root, -b + root):
            hit = (square >= 0.0) & (t >= 0.0) & (t <= 1.0)
            found.append(start[hit] + t[hit, None] * along[hit])
    reach = 2.0 * np.abs(edges).max() + 1.0
    for px, py, nx, ny in regions.half_planes.tolist():
        span = reach + math.hypot(px, py)
        line = np.array([[px - span * ny, py + span * nx, px + span * ny, py - span * nx]])
        found.append(core.segment_crossings(line, edges))
    for loop in unflatten(regions.vertices, regions.offsets):
        sides = np.ascontiguousarray(np.hstack([loop, np.roll(loop, -1, axis=0)]))
        found.append(core.segment_crossings(sides, edges))
    return np.ascontiguousarray(np.concatenate(found))
