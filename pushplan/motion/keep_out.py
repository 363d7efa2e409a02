"""`keep_out`: what is static, grown by the margin of a world."""

from __future__ import annotations

import functools

import numpy as np

from pushplan.world import StaticMap, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import (
    flatten,
    grown_outline,
    grown_outlines,
    transform,
    unflatten,
)
from pushplan.world.static_map import capsule

_LEVELS = 4  # fractions of the margin that an obstacle near the robot may keep


def keep_out(world: World) -> StaticMap:
    """Return the map of what the robot keeps away from: every obstacle grown by ``world.margin``.

    An obstacle that the robot is nearer to than that grows by a fraction of the margin: as many
    quarters as leave the robot a quarter more, or nothing, so that it may always drive on along
    the obstacle, and away. Objects do not count: they may lie at a wall. Corners are sharp
    (`grown_outline`).
    """
    static = world.static
    margin = world.margin
    if margin == 0.0:
        return static
    outlines = [transform(world.robot_pose, part) for part in world.robot.wall_parts]
    reach = world.robot.circumscribed_radius + 2.0 * margin
    boxes = static.boxes
    at = world.robot_pose[:2]
    near = ((boxes[:, :2] < at + reach) & (boxes[:, 2:] > at - reach)).all(axis=1)
    fractions = []
    for k in np.flatnonzero(near).tolist():
        for level in range(_LEVELS, -1, -1):
            grown = _grown_part(static, k, margin * level / _LEVELS)
            if level == 0 or not any(_overlap(grown, part) for part in outlines):
                break
        if level < _LEVELS:
            fractions.append((k, max(level - 1, 0)))
    return _grown(static, margin, tuple(fractions))


@functools.lru_cache(maxsize=32)
def _grown(static: StaticMap, margin: float, fractions: tuple[tuple[int, int], ...]) -> StaticMap:
    """The map with all obstacles grown by the margin, but some by so many quarters of it."""
    count = len(static.polygons)
    margins = np.full(count + len(static.radii), margin)
    for k, level in fractions:
        margins[k] = margin * level / _LEVELS
    outlines = grown_outlines(*flatten(static.polygons), margins[:count])
    radii = static.radii + margins[count:]
    return StaticMap(unflatten(*outlines), static.segments, radii, static.bounds)


def _grown_part(static: StaticMap, k: int, margin: float) -> FloatArray:
    """Obstacle ``k`` as planners see it when it has grown."""
    if k < len(static.polygons):
        return grown_outline(static.polygons[k], margin)
    j = k - len(static.polygons)
    start, end = static.segments[j].reshape(2, 2)
    return capsule(start, end, float(static.radii[j]) + margin)


def _overlap(one: FloatArray, other: FloatArray) -> bool:
    """Return True if two convex outlines overlap: no side of either separates them."""
    for a, b in ((one, other), (other, one)):
        edges = np.roll(a, -1, axis=0) - a
        normals = np.column_stack([edges[:, 1], -edges[:, 0]])
        if ((b @ normals.T).min(axis=0) >= (a * normals).sum(axis=1)).any():
            return False
    return True
