"""Lower bounds on the cost of plans: on their length, and on the work of robot and objects.

`length_bound` comes from shortest paths and the turn limit, `transport_bound` from the ways of
objects. `work_bound` is a proof by branch and bound. A robot whose middle passes an object's middle
nearer than both inscribed discs allow has moved it by what is missing. So each object costs a
robot's path a *depth*, and the cheapest such path is found over intervals of the depths: an
interval [lo, hi] costs mᵢ lo, and keeps the robot's middle out of the disc that is hi smaller.
Shortest paths among discs are exact, so each box of intervals has a bound of its own (branch and
bound: Land and Doig 1960).
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from pushplan.core import motion as core
from pushplan.geometry import VisibilityGraph, object_ways
from pushplan.geometry.obstacles import grown_map
from pushplan.motion.collision import goal_numbers
from pushplan.motion.keep_out import keep_out
from pushplan.motion.speed_profile import TIGHTEST
from pushplan.world import AreaGoal, Drive, StaticMap, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import inscribed_radius
from pushplan.world.static_map import core_map

SLIM: float = core.LengthBound.SLIM
"""Fraction by which the disc is less than the inscribed one: gaps as wide as the robot count."""


def length_bound(world: World, stopped: Callable[[], bool] = lambda: False) -> float:
    """A cost that no plan can undercut [kg m].

    Every path is at least as long as the shortest one of the robot's inscribed disc around the
    walls, and as the shortest one under its turn limit without walls; objects only add to that.
    The former counts as nothing where the robot starts too near to a wall, obstacles have more than
    400 corners, or the stop rule fires.
    """
    robot = world.robot
    radius = 0.0  # it may turn on the spot, or go back, at first
    if robot.drive is Drive.CONSTANT_SPEED or (robot.drive is Drive.CAR and not robot.min_speed):
        radius = max(robot.turning_radius, TIGHTEST * robot.circumscribed_radius)
    bound = core.LengthBound(
        core_map(keep_out(world)),
        world.robot_pose,
        goal_numbers(world.navigation_goal, 0.0),
        robot.mass,
        robot.inscribed_radius,
        radius,
    )
    while not stopped() and not bound.run():
        pass
    return bound.cost()


@dataclass(frozen=True)
class WorkBound:
    """A proven lower bound, and how good it is.

    Args:
        work: that no way to the goal undercuts [kg m].
        relaxed: what the cheapest path of the relaxed problem costs [kg m]: the bound cannot pass
            it, however long it is refined.
        nodes: shortest paths that it took.
    """

    work: float
    relaxed: float
    nodes: int


@dataclass(frozen=True)
class _Node:
    """Intervals of depths (K,) [m], and the shortest path under them."""

    low: FloatArray
    high: FloatArray
    bound: float  # [kg m]
    depths: FloatArray  # (K,) of the path


def work_bound(
    world: World,
    *,
    tolerance: float = 2e-3,
    most_nodes: int = 400,
    stopped: Callable[[], bool] = lambda: False,
) -> WorkBound:
    """A lower bound on m₀ l₀ + Σ mᵢ lᵢ of a robot that gets to its goal [kg m].

    It counts what objects must make way for the robot, and that it may drive around them; not that
    they touch each other, and not that the robot turns. Overlaps that a simulator leaves are not
    counted either. Objects that are fixed are static. Where the robot starts too near to a wall it
    is the `length_bound`.

    Args:
        world: the start.
        tolerance: difference to the relaxed optimum that is good enough, as a fraction.
        most_nodes: shortest paths at most; the bound holds whenever it ends.
        stopped: ends it early.

    Raises:
        InvalidInputError: if the goal is not one for the robot.
    """
    world = world.with_fixed_as_static()
    search = _Relaxation(world)
    least = length_bound(world, stopped)
    root = search.root()
    if root is None:
        return WorkBound(least, least, 1)
    order = itertools.count()
    heap = [(root.bound, next(order), root)]
    relaxed = search.cost(root)
    nodes = 1
    while not stopped() and nodes < most_nodes:
        bound, _, node = heap[0]
        if bound >= (1.0 - tolerance) * relaxed:
            break
        children = search.split(node)
        if not children:
            break
        heapq.heappop(heap)
        for child in children:
            nodes += 1
            if child is not None:
                relaxed = min(relaxed, search.cost(child))
                heapq.heappush(heap, (max(bound, child.bound), next(order), child))
    return WorkBound(max(least, heap[0][0]), max(least, relaxed), nodes)


class _Relaxation:
    """Paths of the inscribed disc of the robot, among objects that are discs."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.static = keep_out(world)
        self.goal = world.navigation_goal
        self.mass = world.robot.mass
        self.masses = world.movables.masses
        self.clearance = (1.0 - SLIM) * world.robot.inscribed_radius
        self.start = world.robot_pose[:2]
        self.centers = world.movables.poses[:, :2]
        count = len(world.movables)
        inner = [max(map(inscribed_radius, world.movables.parts(k))) for k in range(count)]
        self.inner = (1.0 - SLIM) * np.array(inner, dtype=np.float64).reshape(count)
        # a path may pass the origin of an object that is not in it, such as a table: left out
        self.inner[self.inner == 0.0] = -self.clearance

    def root(self) -> _Node | None:
        """All depths are possible; None where there is no path at all, or it begins in a wall."""
        if not grown_map(self.static, self.clearance).keeps_clearance(*self.start.tolist()):
            return None
        reach = self.clearance + self.inner
        away = np.hypot(*(self.centers - self.start).T)
        return self._node(np.maximum(0.0, reach - away), reach)

    def cost(self, node: _Node) -> float:
        """Return the cost of a node's path in the relaxed problem [kg m]."""
        return node.bound + float(self.masses @ np.maximum(0.0, node.depths - node.low))

    def split(self, node: _Node) -> list[_Node | None]:
        """Halve the interval of the object that the path owes most; none where that proves nothing.

        Deeper than r_i no disc keeps the path out, so that no interval beyond it is split.
        """
        depths = np.minimum(node.depths, node.high)
        owed = np.where(node.low < self.inner, self.masses * (depths - node.low), 0.0)
        k = int(np.argmax(owed))
        if owed[k] <= 0.0:
            return []
        deep = node.high[k] > self.inner[k]
        middle = self.inner[k] if deep else 0.5 * (node.low[k] + depths[k])
        less = node.high.copy()
        more = node.low.copy()
        less[k] = more[k] = middle
        return [self._node(node.low, less), self._node(more, node.high)]

    def _node(self, low: FloatArray, high: FloatArray) -> _Node | None:
        solid = np.flatnonzero(self.inner >= high)
        discs = np.concatenate([self.centers[solid], self.centers[solid]], axis=1)
        static = StaticMap(
            self.static.polygons,
            np.concatenate([self.static.segments, discs]),
            np.concatenate([self.static.radii, (self.inner - high)[solid]]),
            self.static.bounds,
        )
        graph = VisibilityGraph(static, self.clearance, exact=True)
        path = graph.to_goal(self.start, self.goal)
        if not np.isfinite(path.length):
            return None
        length = float(path.length) / (1.0 + grown_map(static).excess)
        driven = shapely.linestrings(path.points[[0, *range(len(path.points))]])  # two at least
        near = shapely.distance(shapely.points(self.centers), driven)
        depths = np.maximum(0.0, self.clearance + self.inner - near)
        return _Node(low, high, self.mass * length + float(self.masses @ low), depths)


def transport_bound(world: World) -> float:
    """A lower bound on m₀ l₀ + Σ mᵢ lᵢ of a robot that brings all objects to their goal [kg m].

    The middle of each object that is not done travels at least the shortest path of a point around
    what is static, and for an area its inscribed radius more, as all of the object has to be in
    it, or out of it over an open edge. The robot drives at least up to the nearest object, done or
    not, as that may push the others; how far beyond that has no such bound, as it may push several
    objects at once. Objects that are fixed are static, and need not get anywhere.

    Raises:
        InvalidInputError: if the goal is not one for the objects.
    """
    world = world.with_fixed_as_static()
    goal = world.manipulation_goal
    movables = world.movables
    robot = world.robot
    left = np.flatnonzero(~world.completed)
    if len(left) == 0:
        return 0.0
    ways = object_ways(world.static, goal, movables.ids[left], movables.poses[left, :2])
    lengths = ways / (1.0 + grown_map(world.static).excess)
    lengths[~np.isfinite(lengths)] = 0.0
    for i, (k, way) in enumerate(zip(left, lengths.tolist(), strict=True)):
        if isinstance(goal, AreaGoal) and way > 0.0:
            # an origin outside of its object may get past walls, and need not get anywhere
            inner = max(map(inscribed_radius, movables.drawn_parts(int(k))))
            lengths[i] = way + inner if inner > 0.0 else 0.0
    away = np.hypot(*(movables.poses[:, :2] - world.robot_pose[:2]).T)
    approach = max(0.0, float((away - movables.radii).min()) - robot.circumscribed_radius)
    return robot.mass * approach + float(movables.masses[left] @ lengths)
