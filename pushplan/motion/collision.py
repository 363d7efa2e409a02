"""Whether a footprint is free of obstacles: convex polygons against convex polygons."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from shapely import Polygon

from pushplan.compiled import kernel, owned
from pushplan.geometry import convex_overlap, convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.outline import convex_outline, flatten


class Footprint(NamedTuple):
    """Convex parts of a robot in its body frame."""

    vertices: FloatArray  # (V, 2) [m]
    offsets: IntArray  # (P + 1,)
    radius: float  # Circumscribed radius [m]


class ConvexObstacles(NamedTuple):
    """Convex polygons in the world frame."""

    vertices: FloatArray  # (X, 2) [m]
    offsets: IntArray  # (S + 1,)
    boxes: FloatArray  # (S, 4) x_min, y_min, x_max, y_max of each [m]
    bounds: FloatArray  # (4,) the workspace; a pose outside is not free


@functools.lru_cache(maxsize=64)
def footprint(robot: RobotModel, margin: float = 0.0) -> Footprint:
    """The robot's footprint, every part grown by ``margin`` [m] with sharp corners."""
    if margin == 0.0:
        return Footprint(owned(robot.vertices), owned(robot.offsets), robot.circumscribed_radius)
    parts = []
    for part in robot.parts:
        grown = Polygon(part).buffer(margin, join_style="mitre")
        parts.append(convex_outline("footprint", np.asarray(grown.exterior.coords)[:-1]))
    vertices, offsets = flatten(parts)
    radius = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    return Footprint(owned(vertices), owned(offsets), radius)


def obstacles(static: StaticMap, outlines: Sequence[FloatArray] = ()) -> ConvexObstacles:
    """Everything static, and further convex outlines in the world frame."""
    return _obstacles(static, (*static.convex_parts, *outlines)) if outlines else _walls(static)


@functools.lru_cache(maxsize=32)
def _walls(static: StaticMap) -> ConvexObstacles:
    return _obstacles(static, static.convex_parts)


def _obstacles(static: StaticMap, parts: Sequence[FloatArray]) -> ConvexObstacles:
    vertices, offsets = flatten(parts)
    boxes = np.zeros((len(parts), 4))
    if len(parts):
        boxes[:, :2] = np.minimum.reduceat(vertices, offsets[:-1])
        boxes[:, 2:] = np.maximum.reduceat(vertices, offsets[:-1])
    return ConvexObstacles(owned(vertices), owned(offsets), boxes, owned(static.bounds))


@kernel
def is_free(
    pose: FloatArray,
    shape: Footprint,
    among: ConvexObstacles,
    scratch: FloatArray,  # (V, 2) memory for the corners
) -> bool:
    """Whether a footprint at ``pose`` (3,) overlaps nothing and its origin is in bounds."""
    x, y, r = pose[0], pose[1], shape.radius
    bounds = among.bounds
    if not (bounds[0] <= x <= bounds[2] and bounds[1] <= y <= bounds[3]):
        return False
    placed = False
    for s in range(among.boxes.shape[0]):
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
def first_blocked(
    poses: FloatArray, count: int, shape: Footprint, among: ConvexObstacles, scratch: FloatArray
) -> int:
    """Index of the first of the first ``count`` poses that is not free, or ``count``."""
    for i in range(count):
        if not is_free(poses[i], shape, among, scratch):
            return i
    return count


@kernel
def static_depth(
    pose: FloatArray, shape: Footprint, among: ConvexObstacles, scratch: FloatArray
) -> float:
    """How deep the footprint is in what is static [m]; 0 where it is free."""
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
