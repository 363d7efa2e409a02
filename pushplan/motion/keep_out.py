"""`keep_out`: what is static, grown by the margin of a world."""

from __future__ import annotations

import functools

from pushplan.core import geometry, motion
from pushplan.world import StaticMap, World
from pushplan.world.outline import flatten, unflatten
from pushplan.world.static_map import core_map


def keep_out(world: World) -> StaticMap:
    """Return the map of what the robot keeps away from: every obstacle grown by ``world.margin``.

    An obstacle that the robot is nearer to than that grows by a fraction of the margin: as many
    quarters as leave the robot a quarter more, or nothing, so that it may always drive on along
    the obstacle, and away. Objects do not count: they may lie at a wall. Corners are sharp
    (`grown_outline`).
    """
    if world.margin == 0.0:
        return world.static
    robot = world.robot
    static = core_map(world.static)
    parts = flatten(robot.wall_parts)
    size = robot.circumscribed_radius
    grown = motion.keep_out(static, *parts, size, world.robot_pose, world.margin)
    return _grown(grown, world.static)


@functools.lru_cache(maxsize=32)
def _grown(grown: geometry.StaticMap, static: StaticMap) -> StaticMap:
    """A map of the core, in the bounds of the one that it has grown from."""
    return StaticMap(unflatten(*grown.polygons), static.segments, grown.lines[:, 4], static.bounds)
