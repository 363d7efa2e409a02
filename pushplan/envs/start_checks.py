"""Checks of a start: bodies that overlap, and places that nothing can be brought to."""

from __future__ import annotations

import math
import warnings

import shapely

from pushplan.geometry import convex_penetration
from pushplan.geometry.object_ways import blocked_places
from pushplan.world import World

_LEAN = 0.02
"""Overlap that is ignored, as a fraction of the object's radius: touching bodies overlap a bit."""
_NAMED = 3  # of the deepest overlaps are named


class StartWarning(UserWarning):
    """A start can be simulated, but has overlaps, or places that nothing can reach."""


def check_start(world: World, *, overlaps: bool = False) -> None:
    """Warn of what overlaps in a new start, unless it may, and of places inside static things.

    Args:
        world: the start.
        overlaps: True if objects may overlap one another.
    """
    found = [] if overlaps else _overlaps(world)
    for label, depth in blocked_places(world).items():
        found.append((depth, f"the place of object {label} and something static"))
    if found:
        found.sort(reverse=True)
        named = ", ".join(f"{pair} by {depth:.2g} m" for depth, pair in found[:_NAMED])
        if len(found) > _NAMED:
            named += f" and {len(found) - _NAMED} more"
        warnings.warn(f"the start has overlaps: {named}", StartWarning, stacklevel=3)


def _overlaps(world: World) -> list[tuple[float, str]]:
    """Depth [m] and names of the bodies of each pair of which one can move."""
    world = world.with_fixed_as_static()
    objects = world.movables
    robot = world.robot_outline_world()
    walls = world.static.convex_parts
    owners = objects.part_owners
    parts = [*robot, *objects.every_part_world, *walls]
    names = ["the robot"] * len(robot) + [f"object {label}" for label in objects.ids[owners]]
    sizes = [world.robot.circumscribed_radius] * len(robot) + objects.radii[owners].tolist()
    movable = len(names)
    names += ["something static"] * len(walls)
    sizes += [math.inf] * len(walls)
    tree = shapely.STRtree([shapely.Polygon(part) for part in parts])
    deepest: dict[str, float] = {}
    pairs = tree.query(tree.geometries[:movable], predicate="intersects")
    for i, j in pairs.T.tolist():
        if i < j and names[i] != names[j]:
            depth = convex_penetration(parts[i], parts[j])[0]
            if depth > _LEAN * min(sizes[i], sizes[j]):
                pair = f"{names[i]} and {names[j]}"
                deepest[pair] = max(depth, deepest.get(pair, 0.0))
    return [(depth, pair) for pair, depth in deepest.items()]
