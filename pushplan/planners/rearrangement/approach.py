"""The route to the start of a push: cheapest paths on a lattice, and legs and turns along one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.control import Legs
from pushplan.control.leg_follower import turn_to
from pushplan.core import rearrangement as core
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import ContactGrid, PushScene
from pushplan.world.checks import FloatArray, IntArray

_NO_POSES = np.zeros(0, dtype=np.int64)
_START_REACHES = (1.5, 4.0)
"""Distances [cells] within which a search begins; the greater one if all near poses are blocked."""
_ARRIVAL_REACHES = (1.3, 2.0)
_ARRIVAL_BACK = 0.7
"""Distances [cells] to the poses from which a start is reached, from a place behind it, so that the
robot arrives ahead; the greater one from the start itself, where poses behind it are blocked."""
_TURN_STEP = 0.3  # of the poses of a turn on the spot [rad]
_MOST_CORNERS = 14  # corners of the lattice's path that a route may have corners at
_LONGEST_LEG = 6
"""Points further on that a leg may end at, where the robot has to keep to the lattice's path."""
_MOST_DETOUR = 1.5
"""Factor by which a route may cost more than the lattice's path, beside a radius."""
_FIRST_LEGS = (0.3, -0.3, 0.6, -0.6, 1.0, -1.0)
"""Distances that the robot may drive ahead first, to get to where it can turn, and off an object
that it has just pushed [circumscribed radii]."""


@dataclass(frozen=True, eq=False)
class ApproachTree:
    """Cheapest paths of the robot from where it is to every pose of the lattice.

    Args:
        costs: (16 * rows * columns,) [m].
        before: the pose before each, -1 for none.
        target: index of an object that is not to be moved on the way; -1 if none.
    """

    costs: FloatArray
    before: IntArray
    target: int = -1


def approach_tree(scene: PushScene, target: int = -1) -> ApproachTree:
    """Cheapest paths from where the robot is.

    Args:
        scene: the scene.
        target: index of an object that is not to be moved on the way; -1 if none.
    """
    weights = scene.contact_weights.copy()
    if target >= 0:
        weights[target] += scene.config.around_cost
    return search_approaches(scene, scene.fine, scene.world.robot_pose, weights, target=target)


def search_approaches(
    scene: PushScene,
    contact_grid: ContactGrid,
    pose: FloatArray,
    weights: FloatArray,
    until: IntArray = _NO_POSES,
    target: int = -1,
) -> ApproachTree:
    """Cheapest paths on a lattice.

    Args:
        scene: the scene.
        contact_grid: its lattice, and how deep the robot is in objects there.
        pose: (3,) from where.
        weights: (K,) cost of carrying each object a metre along; 0 if it is gone by then.
        until: flat indices of poses after which to stop; none to go on to the end.
        target: see `ApproachTree`.
    """
    grid, layers = contact_grid
    for reach in _START_REACHES:
        starts, costs = grid.near_poses(pose, reach)
        if len(starts):
            break
    depths, touch = core.add_layers(layers, weights)
    found = grid.search(starts, costs, depths, touch, scene.turn_cost, scene.arm, until)
    return ApproachTree(*found, target)


class Arrivals(NamedTuple):
    """Poses of the lattice from which some places are reached, one place after the other."""

    nodes: IntArray
    extra: FloatArray  # Cost of the rest of the path [m]
    ends: IntArray  # (N,) where the poses of each place end


def arrivals_at(grid: core.PoseGrid, pushes: Sequence[Push]) -> Arrivals:
    """The poses from which the starts of pushes are reached."""
    found = [arrival_poses(grid, push.start) for push in pushes]
    return Arrivals(
        np.concatenate([nodes for nodes, _ in found] or [_NO_POSES]),
        np.concatenate([extra for _, extra in found] or [np.zeros(0)]),
        np.cumsum([len(nodes) for nodes, _ in found], dtype=np.int64),
    )


def arrival_poses(grid: core.PoseGrid, start: FloatArray) -> tuple[IntArray, FloatArray]:
    """Lattice poses from which the start of a push is reached, and the cost of the rest [m]."""
    u = np.array([np.cos(start[2]), np.sin(start[2]), 0.0])
    nodes, extra = grid.near_poses(start - _ARRIVAL_BACK * grid.step * u, _ARRIVAL_REACHES[0])
    if not len(nodes):
        nodes, extra = grid.near_poses(start, _ARRIVAL_REACHES[1])
    return nodes, extra


@dataclass(frozen=True, eq=False)
class Route(Legs):
    """Legs to the start of a push.

    Args:
        points, signs, turns, heading: see `pushplan.control.Legs`.
        cost: length, and what is pushed about on it [m].
    """

    cost: float


def find_route(
    scene: PushScene, approach: ApproachTree, start: FloatArray, target: int = -1
) -> Route | None:
    """The route from the robot to the start of a push; None if there is none.

    Args:
        scene: the scene.
        approach: from where the robot is.
        start: (3,) where to get to.
        target: index of the object that is to be pushed and must not be moved before; -1 if
            none.
    """
    grid = scene.fine.grid
    config = scene.config
    nodes, extra = arrival_poses(grid, start)
    if not len(nodes):
        return None
    total = approach.costs[nodes] + extra
    best = int(np.argmin(total))
    if not math.isfinite(float(total[best])):
        return None
    chain = [int(nodes[best])]
    while approach.before[chain[-1]] >= 0:
        chain.append(int(approach.before[chain[-1]]))
    _, rows, columns = np.unravel_index(chain[::-1], grid.blocked.shape)
    places = np.column_stack([grid.x + columns * grid.step, grid.y + rows * grid.step])
    every = places[np.concatenate([[True], (places[1:] != places[:-1]).any(axis=1)])]
    corners = _corners(places)
    here = scene.world.robot_pose
    end = float(start[2])
    ahead = scene.size * np.array([math.cos(here[2]), math.sin(here[2])])
    near = [here[:2], *(here[:2] + fraction * ahead for fraction in _FIRST_LEGS)]
    expected = math.inf
    weights = scene.contact_weights
    if target >= 0:
        weights = weights.copy()
        if approach.target == target:
            weights[target] += config.around_cost
            expected = _MOST_DETOUR * float(total[best]) + scene.size
        else:
            weights[target] += config.target_cost
    search = scene.route_search(weights)
    cheapest: Route | None = None
    for last in ([start[:2]], []):  # it may be too near to a wall to turn there
        for points, longest in ((corners, len(corners) + 1), (every, _LONGEST_LEG), (every, 1)):
            through = np.array([*near, *points, *last])
            found = _cheapest(search, through, float(here[2]), end, len(near), longest)
            if found is None or (cheapest is not None and found.cost >= cheapest.cost):
                continue
            cheapest = found
            if found.cost <= expected:  # else it has left the lattice's path for a worse one
                return found
    return cheapest


def poses_along(scene: PushScene, route: Route) -> FloatArray:
    """(N, 3) poses on a route, close enough together for a prediction."""
    here: FloatArray = scene.world.robot_pose
    found = [here[None]]
    for point, sign, turn in zip(route.points, route.signs, route.turns[:-1], strict=True):
        dx, dy = (sign * (point - here[:2])).tolist()
        if math.hypot(dx, dy) > 1e-9:
            found.append(_turned(here, math.atan2(dy, dx), turn))
            here = np.array([point[0], point[1], found[-1][-1, 2]])
            found.append(here[None])
    assert route.heading is not None
    found.append(_turned(here, route.heading, float(route.turns[-1])))
    return np.concatenate(found)


def simulate_route(scene: PushScene, route: Route) -> tuple[FloatArray, FloatArray] | None:
    """Poses of the robot (N, 3) and of the objects (N, K, 3) on a route; None if it jams."""
    path = poses_along(scene, route)
    poses = scene.poses.copy()
    out = np.empty((len(path), len(poses), 3))
    jammed = scene.contacts().sweep(path, poses, out)
    return None if jammed >= 0 else (path, out)


def _cheapest(
    search: core.RouteSearch,
    points: FloatArray,
    heading: float,
    end: float,
    first: int,
    longest: int,
) -> Route | None:
    """`RouteSearch.cheapest_legs` as a route; arguments as there."""
    costs, came, turns = search.cheapest_legs(points, heading, end, first, longest)
    cost = float(costs.min())
    if math.isinf(cost):
        return None
    chain = [2 * len(points) - 2 + int(costs[1] < costs[0])]
    while came[chain[-1]] > 0:
        chain.append(int(came[chain[-1]]))
    rows = np.array(chain[::-1])
    return Route(
        points[rows // 2],
        1.0 - 2.0 * (rows % 2),
        np.array([*turns[rows, 0], turns[rows[-1], 1]]),
        end,
        cost,
    )


def _turned(here: FloatArray, to: float, turn: float) -> FloatArray:
    """Poses (N, 3) of a turn on the spot after ``here``, close enough for a prediction."""
    angle = turn_to(float(here[2]), to, turn)
    steps = max(1, math.ceil(abs(angle) / _TURN_STEP))
    poses = np.repeat(here[None], steps, axis=0)
    poses[:, 2] += np.linspace(0.0, angle, steps + 1)[1:]
    return poses


def _corners(places: FloatArray) -> list[FloatArray]:
    """The corners of the lattice's path through places (N, 2), and the middles of long legs."""
    points = [places[0]]
    for before, here, after in zip(places, places[1:], places[2:], strict=False):
        one = here - before
        two = after - here
        turns = abs(one[0] * two[1] - one[1] * two[0]) > 1e-9 or float(one @ two) < 0.0
        stands = not one.any() or not two.any()
        if (turns or stands) and (here != points[-1]).any():
            points.append(here)
    if (places[-1] != points[-1]).any():
        points.append(places[-1])
    while len(points) > _MOST_CORNERS:
        points = points[:1] + points[1:-1:2] + points[-1:]
    return points
