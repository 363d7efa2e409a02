"""Compiled costs of the legs and turns of a `Route`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.control.leg_follower import LITTLE_TURN
from pushplan.geometry import convex_penetration
from pushplan.geometry.angles import wrap_angle
from pushplan.geometry.transforms import transform_points
from pushplan.interaction.kernels import Bodies
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free, static_depth
from pushplan.world.checks import FloatArray, IntArray

SURE_TURN = math.radians(170.0)
"""Up to here a turn is made the shorter way if nothing is said."""
_TIGHT_COST = 25.0
"""Cost of driving on, where the robot begins nearer to something static than it should be."""


class RouteProblem(NamedTuple):
    """Costs of motions."""

    step: float  # Distance of the poses that are looked at [m]
    turn_cost: float  # Of a turn [m/rad]
    arm: float  # Distance by which a turn carries an object along [m/rad]
    shape: Footprint  # With the margin that objects cost from
    tight: Footprint  # With the margin that walls are kept from
    among: ConvexObstacles
    poses: FloatArray  # (K, 3) of the objects
    bodies: Bodies
    weights: FloatArray  # (K,) cost of carrying each object along


@kernel(allocates=True)
def _object_depth(pose: FloatArray, problem: RouteProblem, body: FloatArray) -> tuple[float, float]:
    """Return the depth of the footprint in the objects [m], and the weights of those it is in."""
    shape = problem.shape
    poses = problem.poses
    bodies = problem.bodies
    total = 0.0
    touch = 0.0
    placed = False
    for k in range(poses.shape[0]):
        dx = poses[k, 0] - pose[0]
        dy = poses[k, 1] - pose[1]
        reach = shape.radius + bodies.radii[k]
        if problem.weights[k] == 0.0 or dx * dx + dy * dy >= reach * reach:
            continue
        if not placed:
            transform_points(pose, shape.vertices, body)
            placed = True
        a = bodies.offsets[k]
        b = bodies.offsets[k + 1]
        outline = np.empty((b - a, 2))
        transform_points(poses[k], bodies.vertices[a:b], outline)
        deepest = 0.0
        for p in range(shape.offsets.shape[0] - 1):
            part = body[shape.offsets[p] : shape.offsets[p + 1]]
            deepest = max(deepest, convex_penetration(part, outline)[0])
        if deepest > 0.0:
            total += deepest
            touch += problem.weights[k]
    return total, touch


@kernel(allocates=True)
def _turn(
    x: float, y: float, heading: float, to: float, problem: RouteProblem
) -> tuple[float, float]:
    """Cost of a turn on the spot from one heading to another, and how to make it; see `Route`."""
    here = np.array([x, y, heading])
    there = np.array([x, y, to])
    turn = wrap_angle(to - heading)
    other = turn - math.copysign(2.0 * math.pi, turn)
    cost = _motion(here, there, turn, problem)
    if abs(turn) > LITTLE_TURN and problem.turn_cost * abs(other) < cost:
        longer = _motion(here, there, other, problem)
        if longer < cost:
            cost = longer
            turn = other
    return cost, math.copysign(1.0, turn) if abs(turn) > SURE_TURN else 0.0


@kernel(allocates=True)
def _motion(here: FloatArray, there: FloatArray, turn: float, problem: RouteProblem) -> float:
    """Cost of a straight motion between two poses, or of a turn on the spot; inf at a wall."""
    body = np.empty_like(problem.shape.vertices)
    scratch = np.empty_like(problem.tight.vertices)
    length = math.hypot(there[0] - here[0], there[1] - here[1])
    steps = max(1, math.ceil((length + abs(turn) * problem.shape.radius) / problem.step))
    pose = here.copy()
    depth, _ = _object_depth(pose, problem, body)
    inside = static_depth(pose, problem.tight, problem.among, scratch)
    motion = (length + problem.arm * abs(turn)) / steps
    cost = length + problem.turn_cost * abs(turn)
    for n in range(1, steps + 1):
        part = n / steps
        pose[0] = here[0] + part * (there[0] - here[0])
        pose[1] = here[1] + part * (there[1] - here[1])
        pose[2] = here[2] + part * turn
        if inside > 0.0:  # out of it, but no deeper into it
            before = inside
            inside = static_depth(pose, problem.tight, problem.among, scratch)
            if inside > before:
                return np.inf
            cost += _TIGHT_COST * (length + problem.shape.radius * abs(turn)) / steps
        elif not is_free(pose, problem.tight, problem.among, scratch):
            return np.inf
        now, touch = _object_depth(pose, problem, body)
        if touch > 0.0 and now >= depth:
            cost += motion * touch
        depth = now
    total: float = cost
    return total


@kernel(allocates=True)
def _leg(
    x: float, y: float, heading: float, point: FloatArray, sign: float, problem: RouteProblem
) -> tuple[float, float, float]:
    """Cost of turning to a point (2,) and driving there, the heading then, and how to turn."""
    dx = point[0] - x
    dy = point[1] - y
    if math.hypot(dx, dy) < 1e-9:
        return 0.0, heading, 0.0
    ahead = math.atan2(sign * dy, sign * dx)
    cost, turn = _turn(x, y, heading, ahead, problem)
    if cost < np.inf:
        here = np.array([x, y, ahead])
        there = np.array([point[0], point[1], ahead])
        cost += _motion(here, there, 0.0, problem)
    return cost, ahead, turn


@kernel(allocates=True)
def cheapest_legs(
    points: FloatArray,  # (N, 2), the first is where the robot is
    heading: float,  # of the robot there [rad]
    end: float,  # heading to turn to at the last [rad]
    first: int,  # number of the first points, from which a leg to any other may begin
    longest: int,  # greatest number of points that a leg from another may skip to
    problem: RouteProblem,
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Costs of ending ahead and back; the row before each row (2 i, 2 i + 1); turns (2 N, 2)."""
    count = points.shape[0]
    best = np.empty(2 * count)
    came = np.empty(2 * count, dtype=np.int64)
    headings = np.empty(2 * count)
    turns = np.zeros((2 * count, 2))
    best[:] = np.inf
    came[:] = -1
    headings[:] = heading
    best[0] = 0.0
    for to in range(2, 2 * count):
        j = to // 2
        sign = 1.0 - 2.0 * (to % 2)
        for at in range(2 * j):
            i = at // 2
            if i >= first and i < j - longest:
                continue
            x = points[i, 0]
            y = points[i, 1]
            if best[at] + math.hypot(x - points[j, 0], y - points[j, 1]) >= best[to]:
                continue
            cost, ahead, turn = _leg(x, y, headings[at], points[j], sign, problem)
            cost = best[at] + cost
            last = 0.0
            if j == count - 1 and cost < best[to]:
                more, last = _turn(points[j, 0], points[j, 1], ahead, end, problem)
                cost += more
            if cost < best[to]:
                best[to] = cost
                came[to] = at
                headings[to] = ahead
                turns[to, 0] = turn
                turns[to, 1] = last
    return best[-2:], came, turns
