"""The goal of the objects as the core reads it."""

from __future__ import annotations

import functools

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.world import ClearanceArea, Goal, Receptacle, StaticMap
from pushplan.world.outline import outward_normals


@functools.lru_cache(maxsize=8)
def make_object_goal(goal: Goal, static: StaticMap, slack: float) -> core.ObjectGoal:
    """The goal for the core. Sides of a receptacle that lie on the bounds do not count.

    Args:
        goal: of the objects.
        static: the map with its bounds.
        slack: by how much an object has to be clear of the polygon's edge [m].
    """
    assert isinstance(goal, ClearanceArea | Receptacle)
    polygon = goal.polygon
    normals = outward_normals(polygon)
    offsets = (normals * polygon).sum(axis=1)
    corners = [[x, y] for x in static.bounds[::2] for y in static.bounds[1::2]]
    # the sides of a receptacle that stand at the walls
    inner = (np.array(corners) @ normals.T).max(axis=0) > offsets + 4.0 * slack
    edges = np.column_stack([normals, offsets])[inner]
    return core.ObjectGoal(
        polygon, np.ascontiguousarray(edges), isinstance(goal, Receptacle), slack
    )
