"""Proof that a start is closed at first, and open after some pushes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from pushplan.envs.tasks.namo_layout import Opening
from pushplan.geometry.free_components import FreeComponents
from pushplan.geometry.grid import Grid, clearance_field
from pushplan.world import GoalDisc, StaticMap, World
from pushplan.world.checks import FloatArray

_CELL = 0.1  # side of the cells that are looked at [circumscribed radii]
_GAP = 0.02  # least gap between bodies at the start [circumscribed radii]


def proves(world: World, opening: Sequence[Opening]) -> bool:
    """Return True if a scene is sound and closed at first, and the steps of an opening open it.

    Every step moves boxes straight along free floor, pushed by a robot that gets behind them, and
    has as much floor as it is wide on its way.

    Args:
        world: the start.
        opening: the steps, in order, in metres.
    """
    robot = world.robot
    size = world.robot.circumscribed_radius
    if not _is_sound(world, _GAP * size):
        return False
    if _reaches_goal(_components(world, robot.inscribed_radius), world):
        return False
    for step in opening:
        by = np.array(step.by)
        boxes = list(step.boxes)
        heading = by / np.hypot(*by)
        moved = world.movables.poses.copy()
        corners = np.concatenate([world.movables.outline_world(k) for k in boxes])
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        near = float(((corners - middle) @ heading).min())
        behind = middle + (near - 1.1 * size) * heading
        free = _components(world, size)
        if free.at(world.robot_pose) != free.at(behind) or not free.at(behind):
            return False
        lane = _lane(world, behind, behind + by + 0.1 * size * heading)
        moved[boxes, :2] += by
        after = world.moved(movable_poses=moved, robot_pose=[*(behind + by), 0.0])
        if _hits(world, lane, boxes) or any(
            _hits(world, _swept(world, after, k), boxes) for k in boxes
        ):
            return False
        world = after
    return _reaches_goal(_components(world, size), world)


def _components(world: World, radius: float) -> FreeComponents:
    """The free components of a disc of ``radius`` [m] among walls and boxes."""
    objects = world.movables
    static = world.static
    grid = Grid.cover(static.bounds, _CELL * world.robot.circumscribed_radius)
    parts = [part for k in range(len(objects)) for part in objects.parts_world(k)]
    everything = StaticMap.build([*static.polygons, *parts], bounds=static.bounds)
    return FreeComponents.of(grid, clearance_field(everything, grid), radius)


def _reaches_goal(free: FreeComponents, world: World) -> bool:
    return free.at(world.robot_pose) in free.of_goal(world.navigation_goal)


def _is_sound(world: World, gap: float) -> bool:
    """Return True if no body touches another one, and the robot may turn where it stands."""
    walls = [shapely.Polygon(polygon) for polygon in world.static.polygons]
    count = len(world.movables)
    boxes = [shapely.Polygon(world.movables.outline_world(k)) for k in range(count)]
    robot = shapely.Point(world.robot_pose[:2]).buffer(world.robot.circumscribed_radius)
    for k, box in enumerate([robot, *boxes]):
        others = [*walls, *([robot, *boxes][:k])]
        if any(box.distance(other) <= gap for other in others):
            return False
    goal = world.navigation_goal
    assert isinstance(goal, GoalDisc)
    return all(box.distance(shapely.Point(goal.center)) > goal.radius for box in boxes)


def _lane(world: World, start: FloatArray, end: FloatArray) -> shapely.Geometry:
    """The floor that the robot sweeps on a straight line."""
    return shapely.LineString([start, end]).buffer(
        float(np.abs(world.robot.vertices[:, 1]).max()), cap_style="flat"
    )


def _swept(world: World, after: World, k: int) -> shapely.Geometry:
    """The floor that box ``k`` sweeps."""
    corners = np.concatenate([world.movables.outline_world(k), after.movables.outline_world(k)])
    return shapely.MultiPoint(corners).convex_hull


def _hits(world: World, floor: shapely.Geometry, boxes: Sequence[int]) -> bool:
    """Return True if a piece of floor overlaps a wall, or a box that is none of ``boxes``."""
    others = [k for k in range(len(world.movables)) if k not in boxes]
    shapes = [*world.static.polygons, *(world.movables.outline_world(k) for k in others)]
    return any(floor.intersects(shapely.Polygon(shape)) for shape in shapes)
