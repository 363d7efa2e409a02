"""Places at which the middle of an object is when the object is done."""

from __future__ import annotations

import numpy as np
import shapely

from pushplan.world import ClearanceArea, Goal, InvalidInputError, Receptacle
from pushplan.world.checks import FloatArray


def done_places(goal: Goal, radius: float, inset: float) -> list[FloatArray] | None:
    """The places of an object's middle when it is done: convex polygons and segments.

    Args:
        goal: of the objects.
        radius: of the object [m].
        inset: distance that it keeps from the edges of a receptacle [radii].

    Returns:
        None where a receptacle has no such place.

    Raises:
        InvalidInputError: if the goal is one for the robot.
    """
    if isinstance(goal, Receptacle):
        inner = shapely.Polygon(goal.polygon).buffer(-inset * radius, join_style="mitre")
        if inner.is_empty or inner.area <= 0.0:
            return None
        return [np.asarray(inner.exterior.coords)[:-1]]
    if isinstance(goal, ClearanceArea):
        ends = np.stack([goal.polygon, np.roll(goal.polygon, -1, axis=0)], axis=1)
        along = ends[:, 1] - ends[:, 0]
        outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
        outward *= 1.1 * radius / np.hypot(along[:, 0], along[:, 1])[:, None]
        return list((ends + outward[:, None])[goal.open_edges])
    raise InvalidInputError(f"this needs a goal for the objects, got {type(goal).__name__}")
