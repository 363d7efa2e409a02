"""`LookAround`: drive to where nobody has looked yet."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely
from scipy import ndimage

from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.registry import make_planner
from pushplan.world import ClearanceArea, GoalDisc, PlanningExecutor, Twist, World
from pushplan.world.checks import BoolArray, FloatArray

_HIDES = 0.25  # radius of what may hide where nobody has looked [inscribed radii of the robot]
_LOOKED_UP = 0.5  # time after which it is looked up again what nobody has seen [s]
_NEAR = 2.0  # distance to a place from which it is taken to be seen [circumscribed radii]


class LookAround:
    """Visits the nearest place that nobody has looked at and where an object may be.

    With a `ClearanceArea` only places in the area count. A place that cannot be seen from near it,
    or to which no way leads, is not visited again. When all has been seen, each object is visited
    once more: one that is out of sight may have been pushed by another.

    Args:
        executor: runs planning calls.
        rng: of the planner.
    """

    def __init__(self, executor: PlanningExecutor, rng: np.random.Generator) -> None:
        self._executor = executor
        self._rng = rng
        self._hidden: tuple[float, FloatArray] = (-math.inf, np.zeros((0, 2)))
        self._follower = PlanFollower(make_planner("kinodynamic-rrt"))
        self._target: GoalDisc | None = None
        self._hopeless: list[FloatArray] = []
        self._visited: set[int] = set()

    def command(self, world: World) -> Twist | None:
        """The next velocity; None where nothing is left to look at."""
        if not 0.0 <= world.time - self._hidden[0] < _LOOKED_UP:
            self._hidden = world.time, _hiding_places(world)
        hidden = self._hidden[1]
        target = self._target
        if target is not None:
            seen = not (np.hypot(*(hidden - target.center).T) <= target.radius).any()
            no_way = self._follower.plan_log and self._follower.plan_log[-1].plan is None
            there = target.contains(world.robot_pose[:2])
            if there or no_way:
                self._hopeless.append(target.center)
            if there or no_way or (seen and not self._visited):
                target = None
        if target is None:
            target = self._place(world, hidden) or self._object(world)
            if target is not None:
                self._follower.reset(_at_rest(world, target), self._rng)
                self._follower.plan_with(self._executor)
        self._target = target
        if target is None:
            return None
        return self._follower.act(_at_rest(world, target))

    def _place(self, world: World, hidden: FloatArray) -> GoalDisc | None:
        """The nearest of the places (N, 2) that is worth a visit."""
        radius = _NEAR * world.robot.circumscribed_radius
        for center in self._hopeless:
            hidden = hidden[np.hypot(*(hidden - center).T) > radius]
        if not len(hidden):
            return None
        return GoalDisc(hidden[_nearest(world, hidden)], radius)

    def _object(self, world: World) -> GoalDisc | None:
        """The surroundings of the nearest object that was not visited; it is from now on."""
        left = ~np.isin(world.movables.ids, list(self._visited))
        if not left.any():
            return None
        objects = world.movables.select(left)
        k = _nearest(world, objects.poses[:, :2])
        self._visited.add(int(objects.ids[k]))
        radius = _NEAR * world.robot.circumscribed_radius + float(objects.radii[k])
        return GoalDisc(objects.poses[k, :2], radius)


def _nearest(world: World, points: FloatArray) -> int:
    """Index of the point (N, 2) that is nearest to the robot."""
    return int(np.hypot(*(points - world.robot_pose[:2]).T).argmin())


def _at_rest(world: World, goal: GoalDisc) -> World:
    """The scene with another goal, and with objects that are not to be pushed."""
    fixed = np.ones(len(world.movables), dtype=np.bool_)
    return replace(world.believing(fixed).with_fixed_as_static(), goal=goal)


def _hiding_places(world: World) -> FloatArray:
    """(N, 2) middles of the cells that nobody has seen and that may hold an object [m]."""
    unseen = world.unseen
    assert unseen is not None
    cells: BoolArray = unseen.cells
    points = unseen.centres(cells)
    parts = (*world.movables.every_part_world, *world.static.convex_parts)
    if parts:
        tree = shapely.STRtree([shapely.Polygon(part) for part in parts])
        near, _ = tree.query(shapely.points(points), "dwithin", unseen.resolution)
        covered = np.zeros(len(points), dtype=np.bool_)
        covered[near] = True
        cells = cells.copy()
        cells[cells] = ~covered
    room = ndimage.distance_transform_edt(np.pad(cells, 1))[1:-1, 1:-1]
    cells = unseen.resolution * room > _HIDES * world.robot.inscribed_radius
    points = unseen.centres(cells)
    area = shapely.box(*world.static.bounds)
    if isinstance(world.goal, ClearanceArea):
        area = shapely.Polygon(world.goal.polygon)
    found: FloatArray = points[shapely.contains_xy(area, points)]
    return found
