"""The way to the start of a push: cheapest paths on a lattice, and legs and turns along one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.control import Legs
from pushplan.control.leg_follower import turn_to
from pushplan.interaction.kernels import sweep_path
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.planners.rearrangement.pose_grid_kernels import (
    HEADINGS,
    PoseGrid,
    add_layers,
    near_poses,
)
from pushplan.planners.rearrangement.pose_search_kernels import (
    Arrivals,
    PoseSearchProblem,
    search_poses,
)
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import MARGIN, ContactGrid, PushScene
from pushplan.planners.rearrangement.route_kernels import RouteProblem, cheapest_legs
from pushplan.world.checks import FloatArray, IntArray

_NONE = np.zeros(0, dtype=np.int64)
_MOST = 14  # corners of the lattice's path that a route may have corners at
_LONGEST = 6
"""Points further on that a leg may end at, where the robot has to keep to the lattice's path."""
_MORE = 1.5  # By this factor a route may cost more than the lattice's path, and a radius
_AWAY = (0.3, -0.3, 0.6, -0.6, 1.0, -1.0)
"""How far ahead the robot may drive first, to get to where it can turn, and off an object that it
has just pushed [circumscribed radii]."""


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
    until: IntArray = _NONE,
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
    for reach in (1.5, 4.0):
        starts, costs = near_poses(grid, np.array(pose), reach)
        if len(starts):
            break
    depths, touch = add_layers(layers, weights)
    problem = PoseSearchProblem(
        starts, costs, grid, depths, touch, scene.turn_cost, scene.arm, until
    )
    return ApproachTree(*search_poses(problem), target)


def arrivals_at(grid: PoseGrid, pushes: Sequence[Push]) -> Arrivals:
    """The poses from which the starts of pushes are reached."""
    found = [arrival_poses(grid, push.start) for push in pushes]
    return Arrivals(
        np.concatenate([nodes for nodes, _ in found] or [_NONE]),
        np.concatenate([extra for _, extra in found] or [np.zeros(0)]),
        np.cumsum([len(nodes) for nodes, _ in found], dtype=np.int64),
    )


def arrival_poses(grid: PoseGrid, start: FloatArray) -> tuple[IntArray, FloatArray]:
    """Lattice poses from which the start of a push is reached, and the cost of the rest [m]."""
    u = np.array([np.cos(start[2]), np.sin(start[2]), 0.0])
    nodes, extra = near_poses(grid, start - 0.7 * grid.step * u, 1.3)
    if not len(nodes):
        nodes, extra = near_poses(grid, start, 2.0)
    return nodes, extra


@dataclass(frozen=True, eq=False)
class Route(Legs):
    """Legs to the start of a push.

    Args:
        points, signs, turns, heading: see `pushplan.control.Legs`.
        cost: length, and what is pushed about on the way [m].
    """

    cost: float


class RoutePlanner:
    """Plans routes in one scene."""

    def __init__(self, scene: PushScene) -> None:
        self.scene = scene
        margin = MARGIN * scene.size
        robot = scene.world.robot
        self._problem = RouteProblem(
            step=0.1 * scene.size,
            turn_cost=scene.turn_cost,
            arm=scene.arm,
            shape=footprint(robot, margin),
            tight=footprint(robot, 0.5 * margin),
            among=obstacles(keep_out(scene.world)),
            poses=scene.poses,
            bodies=scene.bodies,
            weights=scene.contact_weights,
        )

    def route(self, approach: ApproachTree, start: FloatArray, target: int = -1) -> Route | None:
        """The route from the robot to the start (3,) of a push; None if there is none.

        Args:
            approach: from where the robot is.
            start: (3,) where to get to.
            target: index of the object that is to be pushed and must not be moved before; -1 if
                none.
        """
        scene = self.scene
        nodes, extra = arrival_poses(scene.fine.grid, start)
        if not len(nodes):
            return None
        total = approach.costs[nodes] + extra
        best = int(np.argmin(total))
        if not math.isfinite(float(total[best])):
            return None
        chain = [int(nodes[best])]
        while approach.before[chain[-1]] >= 0:
            chain.append(int(approach.before[chain[-1]]))
        poses = [_pose_at(scene.fine.grid, node) for node in reversed(chain)]
        here, end = scene.world.robot_pose, float(start[2])
        ahead = scene.size * np.array([math.cos(here[2]), math.sin(here[2])])
        near = [here[:2], *(here[:2] + fraction * ahead for fraction in _AWAY)]
        corners, every = _corners(poses), _places(poses)
        around = target >= 0 and approach.target == target
        problem = self._problem_with(target, around)
        expected = _MORE * float(total[best]) + scene.size if around else math.inf
        cheapest: Route | None = None
        for last in ([start[:2]], []):  # it may be too near to a wall to turn there
            for points, longest in ((corners, len(corners) + 1), (every, _LONGEST), (every, 1)):
                through = np.array([*near, *points, *last])
                found = _cheapest(through, float(here[2]), end, len(near), longest, problem)
                if found is None or (cheapest is not None and found.cost >= cheapest.cost):
                    continue
                cheapest = found
                if found.cost <= expected:  # else it has left the lattice's path for a worse one
                    return found
        return cheapest

    def poses_along(self, route: Route) -> FloatArray:
        """(N, 3) poses on the route, close enough together for a prediction."""
        here: FloatArray = self.scene.world.robot_pose
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

    def simulate(self, route: Route) -> tuple[FloatArray, FloatArray] | None:
        """Poses of the robot (N, 3) and of the objects (N, K, 3) on a route; None if it jams."""
        scene, path = self.scene, self.poses_along(route)
        poses = scene.poses.copy()
        out = np.empty((len(path), len(poses), 3))
        jammed = sweep_path(path, poses, scene.bodies, scene.settings, out)
        return None if jammed >= 0 else (path, out)

    def _problem_with(self, target: int, around: bool) -> RouteProblem:
        """The problem where object ``target`` must not be moved, or rather not."""
        if target < 0:
            return self._problem
        weights, config = self._problem.weights.copy(), self.scene.config
        weights[target] += config.around_cost if around else config.target_cost
        return self._problem._replace(weights=weights)


def _cheapest(
    points: FloatArray,
    heading: float,
    end: float,
    first: int,
    longest: int,
    problem: RouteProblem,
) -> Route | None:
    """`cheapest_legs` as a route; arguments as there."""
    costs, came, turns = cheapest_legs(points, heading, end, first, longest, problem)
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


def _pose_at(grid: PoseGrid, node: int) -> FloatArray:
    """(3,) the pose of a flat index."""
    t, i, j = np.unravel_index(node, grid.blocked.shape)
    return np.array([grid.x + j * grid.step, grid.y + i * grid.step, HEADINGS[t]])


def _turned(here: FloatArray, to: float, turn: float) -> FloatArray:
    """Poses (N, 3) of a turn on the spot after ``here``, close enough for a prediction."""
    angle = turn_to(float(here[2]), to, turn)
    steps = max(1, math.ceil(abs(angle) / 0.3))
    poses = np.repeat(here[None], steps, axis=0)
    poses[:, 2] += np.linspace(0.0, angle, steps + 1)[1:]
    return poses


def _places(poses: list[FloatArray]) -> list[FloatArray]:
    """The points that the lattice's path comes by."""
    points = [pose[:2] for pose in poses]
    return points[:1] + [
        point for before, point in itertools.pairwise(points) if (before != point).any()
    ]


def _corners(poses: list[FloatArray]) -> list[FloatArray]:
    """The corners of the lattice's path, and the middles of long legs."""
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
