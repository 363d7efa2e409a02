"""`LookAround`: drive to where nobody has looked yet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from scipy import ndimage

from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.registry import make_planner
from pushplan.world import ClearanceArea, GoalDisc, Twist, World
from pushplan.world.checks import BoolArray, FloatArray

_HIDES = 0.25  # radius of what may hide where nobody has looked [inscribed radii of the robot]
_NEAR = 2.0  # distance to a place from which it is taken to be seen [circumscribed radii]


class LookAround:
    """Visits the nearest place that nobody has looked at and where an object may be.

    With a `ClearanceArea` only places in the area count. A place that cannot be seen from near it,
    or to which no way leads, is not visited again.
    """

    def __init__(self) -> None:
        self._follower = PlanFollower(make_planner("straight"))
        self._target: GoalDisc | None = None
        self._hopeless: list[FloatArray] = []

    def command(self, world: World) -> Twist | None:
        """The next velocity; None where nothing is left to look at."""
        hidden = _hiding_places(world)
        if hidden is None:
            return None
        target = self._target
        if target is not None and not _any_within(hidden, target.center, target.radius):
            target = None  # it has been seen
        elif target is not None and (
            target.contains(world.robot_pose[:2])
            or (self._follower.plan_log and self._follower.plan_log[-1].plan is None)
        ):
            self._hopeless.append(target.center)
            target = None
        if target is None:
            target = self._next(world, hidden)
            if target is None:
                return None
            self._follower.reset(_at_rest(world, target), np.random.default_rng(0))
        self._target = target
        return self._follower.act(_at_rest(world, target))

    def _next(self, world: World, hidden: FloatArray) -> GoalDisc | None:
        """The nearest of the places (N, 2) that is worth a visit."""
        radius = _NEAR * world.robot.circumscribed_radius
        for center in self._hopeless:
            hidden = hidden[np.hypot(*(hidden - center).T) > radius]
        if not len(hidden):
            return None
        away = np.hypot(*(hidden - world.robot_pose[:2]).T)
        return GoalDisc(hidden[int(np.argmin(away))], radius)


def _at_rest(world: World, goal: GoalDisc) -> World:
    """The scene with another goal, and with objects that are not to be pushed."""
    fixed = np.ones(len(world.movables), dtype=np.bool_)
    return replace(world.believing(fixed).with_fixed_as_static(), goal=goal)


def _any_within(points: FloatArray, center: FloatArray, radius: float) -> bool:
    return bool((np.hypot(*(points - center).T) <= radius).any())


def _hiding_places(world: World) -> FloatArray | None:
    """(N, 2) middles of what nobody has seen and may hold an object [m]; None if there is none."""
    unseen = world.unseen
    if unseen is None:
        return None
    cells: BoolArray = unseen.cells
    points = unseen.centres(cells)
    bodies = [shapely.Polygon(part) for part in world.movables.every_part_world]
    if bodies:
        solid = shapely.buffer(shapely.union_all(bodies), unseen.resolution)
        covered = shapely.contains_xy(solid, points)
        cells = cells.copy()
        cells[cells] = ~covered
    room = ndimage.distance_transform_edt(np.pad(cells, 1))[1:-1, 1:-1]
    cells = unseen.resolution * room > _HIDES * world.robot.inscribed_radius
    points = unseen.centres(cells)
    area = shapely.box(*world.static.bounds)
    if isinstance(world.goal, ClearanceArea):
        area = shapely.Polygon(world.goal.polygon)
    points = points[shapely.contains_xy(area, points)]
    return points if len(points) else None
