"""The goal of the objects for kernels, and the compiled test of objects against it."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry import convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.kernels import Bodies
from pushplan.world import ClearanceArea, Goal, Receptacle, StaticMap
from pushplan.world.checks import BoolArray, FloatArray, frozen
from pushplan.world.outline import outward_normals

REMOVED = 1e7
"""Coordinate of an object that a receptacle has taken [m]."""


class ObjectGoal(NamedTuple):
    """The goal of the objects, as kernels read it."""

    polygon: FloatArray  # (N, 2) the area that objects have to leave, or get into
    edges: FloatArray
    """(E, 3) unit normal and offset of the edges within which a delivered object lies."""
    is_receptacle: bool  # True if objects have to get into the polygon, and are removed there
    slack: float  # By how much an object has to be clear of the polygon's edge [m]


@functools.lru_cache(maxsize=8)
def make_object_goal(goal: Goal, static: StaticMap, slack: float) -> ObjectGoal:
    """The goal for kernels. Sides of a receptacle that lie on the bounds do not count."""
    assert isinstance(goal, ClearanceArea | Receptacle)
    polygon = goal.polygon
    normals = outward_normals(polygon)
    offsets = (normals * polygon).sum(axis=1)
    corners = [[x, y] for x in static.bounds[::2] for y in static.bounds[1::2]]
    # the sides of a receptacle that stand at the walls
    inner = (np.array(corners) @ normals.T).max(axis=0) > offsets + 4.0 * slack
    edges = np.column_stack([normals, offsets])[inner]
    return ObjectGoal(
        polygon, frozen(np.ascontiguousarray(edges)), isinstance(goal, Receptacle), slack
    )


@kernel
def _may_be_done(x: float, y: float, goal: ObjectGoal) -> bool:
    """Return True if an object with its middle at (x, y) could be where it belongs."""
    if goal.is_receptacle:
        for e in range(goal.edges.shape[0]):
            if goal.edges[e, 0] * x + goal.edges[e, 1] * y > goal.edges[e, 2]:
                return False
        return True
    count = goal.polygon.shape[0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        ax = goal.polygon[i, 0]
        ay = goal.polygon[i, 1]
        ex = goal.polygon[j, 0] - ax
        ey = goal.polygon[j, 1] - ay
        if ex * (y - ay) - ey * (x - ax) < 0.0:
            return True
    return False


@kernel(allocates=True)
def is_done(k: int, poses: FloatArray, bodies: Bodies, goal: ObjectGoal) -> bool:
    """Return True if object ``k`` is where it belongs."""
    if poses[k, 0] >= 0.5 * REMOVED:
        return True
    if not _may_be_done(poses[k, 0], poses[k, 1], goal):
        return False
    a = bodies.offsets[k]
    b = bodies.offsets[k + 1]
    outline = np.empty((b - a, 2))
    transform_points(poses[k], bodies.vertices[a:b], outline)
    if goal.is_receptacle:
        for e in range(goal.edges.shape[0]):
            for i in range(b - a):
                out = goal.edges[e, 0] * outline[i, 0] + goal.edges[e, 1] * outline[i, 1]
                if out > goal.edges[e, 2] - goal.slack:
                    return False
        return True
    return bool(convex_penetration(outline, goal.polygon)[0] < -goal.slack)


@kernel(allocates=True)
def all_done(poses: FloatArray, bodies: Bodies, goal: ObjectGoal) -> BoolArray:
    """(K,) whether each object is where it belongs."""
    out = np.empty(poses.shape[0], dtype=np.bool_)
    for k in range(poses.shape[0]):
        out[k] = is_done(k, poses, bodies, goal)
    return out
