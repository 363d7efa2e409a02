"""What both manipulation tasks promise about a start, checked with Shapely alone."""

from __future__ import annotations

import numpy as np
import shapely
from scipy import ndimage

from pushplan.world import World


def shapes(world: World) -> list[shapely.Polygon]:
    return [shapely.Polygon(world.movables.outline_world(k)) for k in range(len(world.movables))]


def check_start(world: World, spacing: float) -> None:
    """No overlaps, boxes in bounds and apart, and the robot gets to all of them."""
    static = shapely.union_all([shapely.Polygon(polygon) for polygon in world.static.polygons])
    floor = shapely.box(*world.static.bounds)
    robot = shapely.union_all([shapely.Polygon(part) for part in world.robot_outline_world()])
    boxes = shapes(world)
    every = shapely.union_all(boxes)
    assert not robot.intersects(static) and floor.contains(robot)
    assert not every.intersects(static) and not every.intersects(robot)
    assert floor.contains(every)
    assert abs(every.area - sum(box.area for box in boxes)) < 1e-9
    centres = world.movables.poses[:, :2]
    apart = np.hypot(*(centres[:, None] - centres[None]).T)
    assert apart[~np.eye(len(boxes), dtype=bool)].min(initial=np.inf) >= spacing - 1e-9


def check_reach(world: World, cell: float) -> None:
    """The robot's disc can go from its start to beside each box, and to the goal."""
    static = shapely.union_all([shapely.Polygon(polygon) for polygon in world.static.polygons])
    radius = world.robot.circumscribed_radius
    x0, y0, x1, y1 = world.static.bounds
    x, y = np.meshgrid(np.arange(x0, x1, cell) + cell / 2, np.arange(y0, y1, cell) + cell / 2)
    free = shapely.distance(shapely.points(x, y), static) > radius
    labels, count = ndimage.label(free)

    def near(point: np.ndarray, reach: float) -> set[int]:
        here = np.hypot(x - point[0], y - point[1]) <= reach
        return set(np.unique(labels[here])) - {0}

    slack = radius + 1.5 * cell
    from_start = near(world.robot_pose[:2], slack)
    half = float(world.movables.radii[0])
    assert count > 0 and from_start
    for centre in world.movables.poses[:, :2]:
        assert from_start & near(centre, slack + half)
    assert from_start & near(world.goal.polygon.mean(axis=0), slack + np.ptp(world.goal.polygon))
