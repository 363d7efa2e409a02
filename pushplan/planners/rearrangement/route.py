"""The way to the start of a push: straight legs ahead or back, and turns on the spot between."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry import convex_penetration
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.kernels import Bodies
from pushplan.motion.collision import (
    Footprint,
    Obstacles,
    footprint,
    is_free,
    obstacles,
)
from pushplan.planners.rearrangement import pose_search
from pushplan.planners.rearrangement.approach import Approach, arrival_poses
from pushplan.planners.rearrangement.pose_grid import pose_at
from pushplan.planners.rearrangement.scene import LED, Scene
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray

_MOST = 14
"""Points of the lattice's way that a route may bend at."""
_LONGEST = 6
"""Points further on that a leg may end at, where the robot has to keep to the lattice's way."""
_AWAY = (0.3, -0.3, 0.6, -0.6, 1.0, -1.0)
"""How far ahead the robot may drive first to get to where it can turn [circumscribed radii]."""
_SURE = math.radians(170.0)
"""Up to here a turn is made the shorter way if nothing is said."""
_LITTLE = 0.6
"""A turn by less is not made the longer way [rad]."""
TIGHT = 25.0
"""Price of driving on, where the robot begins nearer to something static than it should be."""


@dataclass(frozen=True, eq=False)
class Route(ArrayRecord):
    """Legs of a drive.

    Args:
        points: (N, 2) where each leg ends [m].
        signs: (N,) 1 ahead, -1 back.
        turns: (N + 1,) how to turn on the spot before each leg, and at the end: 1 to the left, -1
            to the right, 0 the shorter way.
        heading: to turn to at the end [rad].
        price: length, and what is pushed about on the way [m].
    """

    points: FloatArray
    signs: FloatArray
    turns: FloatArray
    heading: float
    price: float


@kernel(allocates=True)
def _depth(
    pose: FloatArray,
    shape: Footprint,
    poses: FloatArray,
    bodies: Bodies,
    weights: FloatArray,
    body: FloatArray,
) -> tuple[float, float]:
    """How deep the footprint is in the objects [m], and the weights of those it is in."""
    total, touch, placed = 0.0, 0.0, False
    for k in range(poses.shape[0]):
        dx, dy = poses[k, 0] - pose[0], poses[k, 1] - pose[1]
        reach = shape.radius + bodies.radii[k]
        if weights[k] == 0.0 or dx * dx + dy * dy >= reach * reach:
            continue
        if not placed:
            transform_points(pose, shape.vertices, body)
            placed = True
        a, b = bodies.offsets[k], bodies.offsets[k + 1]
        outline = np.empty((b - a, 2))
        transform_points(poses[k], bodies.vertices[a:b], outline)
        deepest = 0.0
        for p in range(shape.offsets.shape[0] - 1):
            part = body[shape.offsets[p] : shape.offsets[p + 1]]
            deepest = max(deepest, convex_penetration(part, outline)[0])
        if deepest > 0.0:
            total += deepest
            touch += weights[k]
    return total, touch


@kernel(allocates=True)
def depth_inside(
    pose: FloatArray, shape: Footprint, among: Obstacles, scratch: FloatArray
) -> float:
    """How deep the footprint is in what is static [m]; 0 where it is free.

    Arguments as those of `is_free`.
    """
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


class _Driving(NamedTuple):
    """What motions are priced from."""

    step: float
    """Distance of the poses that are looked at [m]."""
    turn_price: float
    arm: float
    shape: Footprint
    tight: Footprint
    among: Obstacles
    poses: FloatArray
    bodies: Bodies
    weights: FloatArray


@kernel(allocates=True)
def _turn(x: float, y: float, heading: float, to: float, by: _Driving) -> tuple[float, float]:
    """Price of a turn on the spot from one heading to another, and how to make it; see `Route`."""
    here, there = np.array([x, y, heading]), np.array([x, y, to])
    turn = to - heading
    turn -= 2.0 * math.pi * np.round(turn / (2.0 * math.pi))
    other = turn - math.copysign(2.0 * math.pi, turn)
    price = _motion(here, there, turn, by)
    if abs(turn) > _LITTLE and by.turn_price * abs(other) < price:
        longer = _motion(here, there, other, by)
        if longer < price:
            price, turn = longer, other
    return price, math.copysign(1.0, turn) if abs(turn) > _SURE else 0.0


@kernel(allocates=True)
def _motion(here: FloatArray, there: FloatArray, turn: float, by: _Driving) -> float:
    """Price of a straight motion between two poses, or of a turn on the spot; inf at a wall."""
    body = np.empty_like(by.shape.vertices)
    scratch = np.empty_like(by.tight.vertices)
    length = math.hypot(there[0] - here[0], there[1] - here[1])
    steps = max(1, math.ceil((length + abs(turn) * by.shape.radius) / by.step))
    pose = here.copy()
    depth, _ = _depth(pose, by.shape, by.poses, by.bodies, by.weights, body)
    inside = depth_inside(pose, by.tight, by.among, scratch)
    motion = (length + by.arm * abs(turn)) / steps
    price = length + by.turn_price * abs(turn)
    for n in range(1, steps + 1):
        part = n / steps
        pose[0] = here[0] + part * (there[0] - here[0])
        pose[1] = here[1] + part * (there[1] - here[1])
        pose[2] = here[2] + part * turn
        if inside > 0.0:  # out of it, but no deeper into it
            before, inside = inside, depth_inside(pose, by.tight, by.among, scratch)
            if inside > before:
                return np.inf
            price += TIGHT * (length + by.shape.radius * abs(turn)) / steps
        elif not is_free(pose, by.tight, by.among, scratch):
            return np.inf
        now, touch = _depth(pose, by.shape, by.poses, by.bodies, by.weights, body)
        if touch > 0.0 and now >= depth:
            price += motion * touch
        depth = now
    total: float = price
    return total


@kernel(allocates=True)
def _leg(
    x: float, y: float, heading: float, point: FloatArray, sign: float, by: _Driving
) -> tuple[float, float, float]:
    """Price of turning to a point (2,) and driving there, the heading then, and how to turn."""
    dx, dy = point[0] - x, point[1] - y
    if math.hypot(dx, dy) < 1e-9:
        return 0.0, heading, 0.0
    way = math.atan2(sign * dy, sign * dx)
    price, turn = _turn(x, y, heading, way, by)
    if price < np.inf:
        price += _motion(np.array([x, y, way]), np.array([point[0], point[1], way]), 0.0, by)
    return price, way, turn


@kernel(allocates=True)
def _cheapest(
    points: FloatArray, heading: float, end: float, first: int, longest: int, by: _Driving
) -> tuple[FloatArray, IntArray, FloatArray]:
    """The cheapest way over some points to the last one, and a turn to a heading there.

    Args:
        points: (N, 2), the first is where the robot is.
        heading: of the robot there [rad].
        end: heading to turn to at the last [rad].
        first: how many of the first points a leg to any other may begin at.
        longest: how many points further on a leg from another may end.
        by: what motions are priced from.

    Returns:
        The price if the last point is got to ahead and back; for each point, got to ahead and back
        (rows 2 i and 2 i + 1), which row the leg begins at; and how to turn before it, and at the
        end if it is the last: (2 N, 2), see `Route`.
    """
    count = points.shape[0]
    best, came = np.full(2 * count, np.inf), np.full(2 * count, -1, dtype=np.int64)
    headings, turns = np.full(2 * count, heading), np.zeros((2 * count, 2))
    best[0] = 0.0
    for to in range(2, 2 * count):
        j, sign = to // 2, 1.0 - 2.0 * (to % 2)
        for at in range(2 * j):
            i = at // 2
            if i >= first and i < j - longest:
                continue
            away = math.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1])
            if best[at] + away >= best[to]:
                continue
            price, way, turn = _leg(points[i, 0], points[i, 1], headings[at], points[j], sign, by)
            price, last = best[at] + price, 0.0
            if j == count - 1 and price < best[to]:
                more, last = _turn(points[j, 0], points[j, 1], way, end, by)
                price += more
            if price < best[to]:
                best[to], came[to], headings[to] = price, at, way
                turns[to, 0], turns[to, 1] = turn, last
    return best[-2:], came, turns


class Router:
    """Makes routes in one scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        margin = scene.config.margin * scene.size
        robot = scene.world.robot
        self._shape = footprint(robot, margin)
        self._tight = footprint(robot, 0.5 * margin)
        self._among = obstacles(scene.world.static)

    def route(self, approach: Approach, start: FloatArray, led: int = -1) -> Route | None:
        """The way from the robot to the start (3,) of a push; None if there is none.

        Args:
            approach: from where the robot is.
            start: (3,) where to get to.
            led: index of the object that is to be pushed and must not be moved before; -1 if none.
        """
        scene = self.scene
        nodes, extra = arrival_poses(scene.fine, start)
        if not len(nodes):
            return None
        total = approach.costs[nodes] + extra
        best = int(np.argmin(total))
        if not math.isfinite(float(total[best])):
            return None
        chain = [int(nodes[best])]
        while approach.before[chain[-1]] >= 0:
            chain.append(int(approach.before[chain[-1]]))
        poses = [pose_at(scene.fine.floor, node) for node in reversed(chain)]
        here, end = scene.world.robot_pose, float(start[2])
        ahead = scene.size * np.array([math.cos(here[2]), math.sin(here[2])])
        near = [here[:2], *(here[:2] + share * ahead for share in _AWAY)]
        bends, every = _bends(poses), _places(poses)
        by = self._driving(led)
        for last in ([start[:2]], []):  # it may be too near to a wall to turn there
            for first, points, longest in (
                ([here[:2]], bends, len(bends) + 1),
                (near, every, _LONGEST),
                (near, every, 1),
            ):
                through = np.array([*first, *points, *last])
                found = _shortened(through, float(here[2]), end, len(first), longest, by)
                if found is not None:
                    return found
        return None

    def poses_along(self, route: Route) -> FloatArray:
        """(N, 3) poses on the way, close enough together for a prediction."""
        here: FloatArray = self.scene.world.robot_pose
        found = [here[None]]
        for point, sign, turn in zip(route.points, route.signs, route.turns[:-1], strict=True):
            dx, dy = (sign * (point - here[:2])).tolist()
            if math.hypot(dx, dy) > 1e-9:
                way = math.atan2(dy, dx)
                found.append(_turned(here, way, turn))
                here = np.array([point[0], point[1], found[-1][-1, 2]])
                found.append(here[None])
        found.append(_turned(here, route.heading, float(route.turns[-1])))
        return np.concatenate(found)

    def _driving(self, led: int) -> _Driving:
        """What motions are priced from, where object ``led`` must not be moved."""
        scene = self.scene
        weights = scene.nuisance.copy()
        if led >= 0:
            weights[led] += LED
        return _Driving(
            0.1 * scene.size,
            scene.config.turn_price * scene.size,
            pose_search.ARM * scene.size,
            self._shape,
            self._tight,
            self._among,
            scene.poses,
            scene.bodies,
            weights,
        )


def _shortened(
    points: FloatArray, heading: float, end: float, first: int, longest: int, by: _Driving
) -> Route | None:
    """`_cheapest` as a route; arguments as there."""
    prices, came, turns = _cheapest(points, heading, end, first, longest, by)
    price = float(prices.min())
    if math.isinf(price):
        return None
    chain = [2 * len(points) - 2 + int(prices[1] < prices[0])]
    while came[chain[-1]] > 0:
        chain.append(int(came[chain[-1]]))
    rows = np.array(chain[::-1])
    return Route(
        points[rows // 2],
        1.0 - 2.0 * (rows % 2),
        np.array([*turns[rows, 0], turns[rows[-1], 1]]),
        end,
        price,
    )


def turn_to(heading: float, to: float, turn: float) -> float:
    """The turn [rad] that is still to be made from one heading to another, the way it is meant.

    Args:
        heading, to: [rad].
        turn: as in `Route`; the last bit of a turn is made the shorter way in any case.
    """
    left = math.remainder(to - heading, 2.0 * math.pi)
    if left * turn < 0.0 and abs(left) > 0.5 * _LITTLE:
        left += math.copysign(2.0 * math.pi, turn)
    return left


def _turned(here: FloatArray, to: float, turn: float) -> FloatArray:
    """Poses (N, 3) of a turn on the spot after ``here``, close enough for a prediction."""
    angle = turn_to(float(here[2]), to, turn)
    steps = max(1, math.ceil(abs(angle) / 0.3))
    poses = np.repeat(here[None], steps, axis=0)
    poses[:, 2] += np.linspace(0.0, angle, steps + 1)[1:]
    return poses


def _places(poses: list[FloatArray]) -> list[FloatArray]:
    """Where the lattice's way comes by."""
    points = [pose[:2] for pose in poses]
    return points[:1] + [
        point for before, point in itertools.pairwise(points) if (before != point).any()
    ]


def _bends(poses: list[FloatArray]) -> list[FloatArray]:
    """Where the lattice's way bends, and in the middle of long legs."""
    points = [poses[0][:2]]
    for before, here, after in zip(poses, poses[1:], poses[2:], strict=False):
        one, two = here[:2] - before[:2], after[:2] - here[:2]
        if not one.any() or not two.any():
            if np.hypot(*(here[:2] - points[-1])) > 0.0:
                points.append(here[:2])
        elif abs(one[0] * two[1] - one[1] * two[0]) > 1e-9 or float(one @ two) < 0.0:
            points.append(here[:2])
    if np.hypot(*(poses[-1][:2] - points[-1])) > 0.0:
        points.append(poses[-1][:2])
    while len(points) > _MOST:
        points = points[:1] + points[1:-1:2] + points[-1:]
    return points
