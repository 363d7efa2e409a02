"""Footprint, obstacles and goal of a robot, as the collision checks of the core read them."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from shapely import Polygon

from pushplan.core import motion as core
from pushplan.world import GoalDisc, NavigationGoal, RobotModel, StaticMap
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.outline import convex_outline, flatten, outline_boxes

GROUP = 16
"""Polygons whose boxes are looked at together."""


@functools.lru_cache(maxsize=64)
def footprint(robot: RobotModel, margin: float = 0.0) -> core.Footprint:
    """Return the robot's parts that count at walls, grown by ``margin`` [m] with sharp corners.

    A negative margin makes them smaller; those of which nothing is left are left out.
    """
    parts = list(robot.wall_parts)
    if margin != 0.0:
        grown = [Polygon(part).buffer(margin, join_style="mitre").exterior for part in parts]
        rings = [np.asarray(ring.coords)[:-1] for ring in grown if not ring.is_empty]
        parts = [convex_outline("footprint", ring) for ring in rings]
    vertices, offsets = flatten(parts)
    radius = float(np.hypot(vertices[:, 0], vertices[:, 1]).max(initial=0.0))
    return core.Footprint(vertices, offsets, radius)


def obstacles(
    static: StaticMap, outlines: Sequence[FloatArray] = (), bounds: FloatArray | None = None
) -> core.ConvexObstacles:
    """Everything static, and further convex outlines in the world frame.

    Args:
        static: the map.
        outlines: of what else is in the way, each (N, 2) [m].
        bounds: (4,) other bounds of the workspace [m]; a pose outside is not free.
    """
    if not outlines and bounds is None:
        return _walls(static)
    vertices, offsets = flatten([*static.convex_parts, *outlines])
    boxes = outline_boxes(vertices, offsets)
    return _obstacles(vertices, offsets, boxes, static.bounds if bounds is None else bounds)


@functools.lru_cache(maxsize=32)
def _walls(static: StaticMap) -> core.ConvexObstacles:
    return _obstacles(*static.packed, static.boxes, static.bounds)


def _obstacles(
    vertices: FloatArray, offsets: IntArray, boxes: FloatArray, bounds: FloatArray
) -> core.ConvexObstacles:
    if len(boxes) > GROUP:
        order = _packed(vertices[offsets[:-1]])
        sizes = np.diff(offsets)[order]
        starts = offsets[order]
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        vertices = vertices[np.repeat(starts - offsets[:-1], sizes) + np.arange(offsets[-1])]
        boxes = boxes[order]
    groups = np.zeros((0, 4))
    if len(boxes):
        first = np.arange(0, len(boxes), GROUP)
        groups = np.hstack(
            [np.minimum.reduceat(boxes[:, :2], first), np.maximum.reduceat(boxes[:, 2:], first)]
        )
    return core.ConvexObstacles(vertices, offsets, boxes, np.ascontiguousarray(groups), bounds)


def _packed(places: FloatArray) -> IntArray:
    """An order of places (S, 2) in which groups lie near each other, as in a packed R-tree.

    Leutenegger, Lopez and Edgington, "STR: a simple and efficient algorithm for R-tree packing",
    1997: vertical slices, each sorted along y.
    """
    by_x = np.argsort(places[:, 0], kind="stable")
    slices = int(np.ceil(np.sqrt(len(places) / GROUP)))
    size = GROUP * int(np.ceil(len(places) / (slices * GROUP)))
    rank = np.argsort(by_x)
    return np.lexsort((places[:, 1], rank // size))


def goal_numbers(goal: NavigationGoal, inset: float) -> FloatArray:
    """A goal as numbers, entered by ``inset`` [m] so that noise does not miss it.

    Returns:
        (5,) 0, x, y, radius, 0 for a disc; 1, x, y, n_x, n_y for a line.
    """
    if isinstance(goal, GoalDisc):
        radius = max(goal.radius - inset, 0.5 * goal.radius)
        return np.array([0.0, goal.center[0], goal.center[1], radius, 0.0])
    point = goal.point + inset * goal.normal
    return np.array([1.0, point[0], point[1], goal.normal[0], goal.normal[1]])
