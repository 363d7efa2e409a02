"""Collision checks of a footprint: convex polygons against convex polygons."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from shapely import Polygon

from pushplan.compiled import kernel, owned
from pushplan.core import motion as core
from pushplan.geometry import convex_overlap, convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.outline import convex_outline, flatten, outline_boxes

GROUP = 16
"""Polygons whose boxes are looked at together."""


class Footprint(NamedTuple):
    """Convex parts of a robot in its body frame."""

    vertices: FloatArray  # (V, 2) [m]
    offsets: IntArray  # (P + 1,)
    radius: float  # Circumscribed radius [m]


class ConvexObstacles(NamedTuple):
    """Convex polygons in the world frame, in groups of neighbours."""

    vertices: FloatArray  # (X, 2) [m]
    offsets: IntArray  # (S + 1,)
    boxes: FloatArray  # (S, 4) x_min, y_min, x_max, y_max of each [m]
    groups: FloatArray  # (ceil(S / GROUP), 4) the same of each group of `GROUP` polygons
    bounds: FloatArray  # (4,) the workspace; a pose outside is not free


@functools.lru_cache(maxsize=64)
def footprint(robot: RobotModel, margin: float = 0.0) -> core.Footprint:
    """Return the robot's parts that count at walls, grown by ``margin`` [m] with sharp corners."""
    return core.Footprint(*footprint_arrays(robot, margin))


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
        return _core_walls(static)
    arrays = obstacle_arrays(static, outlines)
    if bounds is not None:
        arrays = arrays._replace(bounds=bounds)
    return core.ConvexObstacles(*arrays)


@functools.lru_cache(maxsize=32)
def _core_walls(static: StaticMap) -> core.ConvexObstacles:
    return core.ConvexObstacles(*_walls(static))


@functools.lru_cache(maxsize=64)
def footprint_arrays(robot: RobotModel, margin: float = 0.0) -> Footprint:
    """`footprint` for kernels."""
    parts = list(robot.wall_parts)
    if margin != 0.0:
        grown = [Polygon(part).buffer(margin, join_style="mitre").exterior for part in parts]
        parts = [convex_outline("footprint", np.asarray(ring.coords)[:-1]) for ring in grown]
    vertices, offsets = flatten(parts)
    radius = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    return Footprint(owned(vertices), owned(offsets), radius)


def obstacle_arrays(static: StaticMap, outlines: Sequence[FloatArray] = ()) -> ConvexObstacles:
    """`obstacles` for kernels."""
    if not outlines:
        return _walls(static)
    return _obstacles(static, (*static.convex_parts, *outlines))


@functools.lru_cache(maxsize=32)
def _walls(static: StaticMap) -> ConvexObstacles:
    return _obstacles(static, static.convex_parts)


def _obstacles(static: StaticMap, parts: Sequence[FloatArray]) -> ConvexObstacles:
    if len(parts) > GROUP:
        parts = [parts[k] for k in _packed(np.array([part[0] for part in parts]))]
    vertices, offsets = flatten(parts)
    boxes = outline_boxes(vertices, offsets)
    groups = np.zeros((0, 4))
    if len(parts):
        first = np.arange(0, len(parts), GROUP)
        groups = np.hstack(
            [np.minimum.reduceat(boxes[:, :2], first), np.maximum.reduceat(boxes[:, 2:], first)]
        )
    return ConvexObstacles(
        owned(vertices), owned(offsets), boxes, np.ascontiguousarray(groups), owned(static.bounds)
    )


def _packed(places: FloatArray) -> list[int]:
    """An order of places (S, 2) in which groups lie near each other, as in a packed R-tree.

    Leutenegger, Lopez and Edgington, "STR: a simple and efficient algorithm for R-tree packing",
    1997: vertical slices, each sorted along y.
    """
    by_x = np.argsort(places[:, 0], kind="stable")
    slices = int(np.ceil(np.sqrt(len(places) / GROUP)))
    size = GROUP * int(np.ceil(len(places) / (slices * GROUP)))
    rank = np.argsort(by_x)
    order: list[int] = np.lexsort((places[:, 1], rank // size)).tolist()
    return order


@kernel
def is_free(
    pose: FloatArray,
    shape: Footprint,
    among: ConvexObstacles,
    scratch: FloatArray,  # (V, 2) memory for the corners
) -> bool:
    """Return True if a footprint at ``pose`` (3,) overlaps nothing and its origin is in bounds."""
    x = pose[0]
    y = pose[1]
    r = shape.radius
    bounds = among.bounds
    if not (bounds[0] <= x <= bounds[2] and bounds[1] <= y <= bounds[3]):
        return False
    placed = False
    for g in range(among.groups.shape[0]):
        box = among.groups[g]
        if x + r <= box[0] or x - r >= box[2] or y + r <= box[1] or y - r >= box[3]:
            continue
        for s in range(g * GROUP, min((g + 1) * GROUP, among.boxes.shape[0])):
            box = among.boxes[s]
            if x + r <= box[0] or x - r >= box[2] or y + r <= box[1] or y - r >= box[3]:
                continue
            if not placed:
                transform_points(pose, shape.vertices, scratch)
                placed = True
            obstacle = among.vertices[among.offsets[s] : among.offsets[s + 1]]
            for p in range(shape.offsets.shape[0] - 1):
                if convex_overlap(scratch[shape.offsets[p] : shape.offsets[p + 1]], obstacle):
                    return False
    return True


@kernel
def static_depth(
    pose: FloatArray, shape: Footprint, among: ConvexObstacles, scratch: FloatArray
) -> float:
    """Return the depth of the footprint in static obstacles [m]; 0 where it is free."""
    deepest = 0.0
    if is_free(pose, shape, among, scratch):
        return deepest
    transform_points(pose, shape.vertices, scratch)
    for s in range(among.boxes.shape[0]):
        obstacle = among.vertices[among.offsets[s] : among.offsets[s + 1]]
        for p in range(shape.offsets.shape[0] - 1):
            part = scratch[shape.offsets[p] : shape.offsets[p + 1]]
            deepest = max(deepest, convex_penetration(part, obstacle)[0])
    return deepest
