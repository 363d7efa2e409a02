"""Distance fields that costs are read from; made once for a map and a goal."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from pushplan.core import geometry as core
from pushplan.geometry import GeodesicField, GoalDistances, geodesic_field, goal_distances
from pushplan.motion.done_places import done_places
from pushplan.world import AreaGoal, ClearanceArea, Goal, Receptacle, StaticMap
from pushplan.world.checks import FloatArray, frozen

_INSET = 1.05  # distance of an object's middle from the edges of a receptacle when it is done [r]
CLEARANCE = 0.7
"""Distance that an object's middle keeps from what is static [r]."""
_OUTSET = 1.1  # the same from the edge of a clearance area


class Field(NamedTuple):
    """A distance field."""

    values: FloatArray  # (rows, columns) [m], finite
    x: float  # Least x of the grid [m]
    y: float  # Least y
    cell: float  # Side of a cell [m]


def sample(field: Field, points: FloatArray) -> FloatArray:
    """Distances (...) at points (..., 2) [m]."""
    out = np.empty(points.shape[:-1])
    core.sample_points(*field, np.ascontiguousarray(points.reshape(-1, 2)), out.reshape(-1))
    return out


def finite(values: FloatArray) -> FloatArray:
    """The values with a number in place of inf: a little more than the greatest one."""
    known = np.isfinite(values)
    most = 1.1 * float(values[known].max()) if known.any() else 0.0
    return np.ascontiguousarray(np.where(known, values, most))


def _as_field(values: FloatArray, of: GeodesicField) -> Field:
    origin = of.grid.origin
    return Field(frozen(finite(values)), float(origin[0]), float(origin[1]), of.grid.resolution)


@functools.lru_cache(maxsize=16)
def robot_field(static: StaticMap, goal: Goal, clearance: float, cell: float) -> Field:
    """Way of the robot's middle to its goal [m], around what is static."""
    field = geodesic_field(static, goal, resolution=cell, clearance=clearance)
    return _as_field(field.filled, field)


def _places(goal: AreaGoal, radius: float) -> AreaGoal | list[FloatArray]:
    """Return the places at which the middle of an object is when the object is done."""
    places = done_places(goal, radius, _INSET)
    if not places and isinstance(goal, Receptacle):  # too narrow: as deep as possible
        middle = goal.polygon.mean(axis=0)
        return [np.stack([middle, middle])]
    return places or goal


@functools.lru_cache(maxsize=16)
def object_ways(
    static: StaticMap, goal: AreaGoal, radius: float, clearance: float
) -> GoalDistances:
    """Ways of an object's middle to where it is done, around what is static.

    Args:
        static: walls and columns.
        goal: of the objects.
        radius: circumscribed radius of the object [m].
        clearance: distance that its middle keeps from what is static [m].
    """
    return goal_distances(static, _places(goal, radius), clearance=clearance)


@functools.lru_cache(maxsize=16)
def object_field(
    static: StaticMap, goal: AreaGoal, radius: float, clearance: float, cell: float
) -> Field:
    """Lengths of `object_ways` on a grid; 0 beyond the edge of a clearance area too."""
    places = _places(goal, radius)
    found = geodesic_field(static, places, resolution=cell, clearance=clearance)
    values = found.filled
    if isinstance(goal, ClearanceArea):
        x, y = np.meshgrid(found.grid.x, found.grid.y)
        along = np.roll(goal.polygon, -1, axis=0) - goal.polygon
        lengths = np.hypot(along[:, 0], along[:, 1])
        gaps = [
            ((x - a[0]) * e[1] - (y - a[1]) * e[0]) / n
            for a, e, n in zip(goal.polygon, along, lengths, strict=True)
        ]
        values = np.where(np.max(gaps, axis=0) >= _OUTSET * radius, 0.0, values)
    return _as_field(values, found)
