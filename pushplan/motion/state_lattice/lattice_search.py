"""From the robot into a lattice, and from what was found there to the poses of a path."""

from __future__ import annotations

import math

import numpy as np

from pushplan.core import motion as core
from pushplan.core import search
from pushplan.geometry.angles import wrap_angle
from pushplan.motion.collision import goal_numbers
from pushplan.motion.speed_profile import SweptPath
from pushplan.motion.state_lattice.built_lattice import BuiltLattice
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.motion.state_lattice.lattice_config import SPACING, LatticeConfig
from pushplan.motion.state_lattice.primitives import connections
from pushplan.motion.state_lattice.swaths import flat_runs
from pushplan.motion.time_slicing import go_on
from pushplan.world import GoalLine, World
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.polyline import arc_lengths

_NEAREST = 4  # headings of the lattice that a robot between two of them may turn to
_PATHS = 8  # paths to each of them
_SLACK = 0.8  # greatest turn beyond the change of heading [rad]


def open_search(
    built: BuiltLattice, builder: LatticeBuilder
) -> tuple[core.LatticeSearch, list[FloatArray]]:
    """A search from the robot: from its node, or from where short curves lead to.

    Returns:
        The search, and for start edge -2 - i the (3, 2) arcs [steps] of curve i.
    """
    lattice = built.lattice
    motions = built.motions
    star = core.LatticeSearch(built.graph, built.size)
    row, column, heading = built.start
    turns = np.abs(wrap_angle(motions.angles - heading))
    nearest = int(np.argmin(turns))
    if turns[nearest] < 1e-6:
        node = built.node(nearest, row, column)
        star.start(node, bound=built.graph.estimate(node))
        return star, []
    robot = builder.world.robot
    vertices = robot.vertices / builder.cell
    reach = robot.circumscribed_radius / builder.cell
    curves: list[FloatArray] = []
    for h in np.argsort(turns, kind="stable")[:_NEAREST].tolist():
        for length, u, v, *arcs in connections(
            heading, float(motions.angles[h]), motions.config, _SLACK
        )[:_PATHS]:
            go_on(builder.stopped)
            to_row = row + round(u)
            to_column = column + round(v)
            if not (0 <= to_row < lattice.rows and 0 <= to_column < lattice.columns):
                continue
            box = np.array([min(u, 0), max(u, 0), min(v, 0), max(v, 0)])
            if not built.graph.within(row, column, box):
                continue
            curves.append(np.array(arcs).reshape(3, 2))
            arcs_cells = curves[-1] * np.array([lattice.cells, 1.0 / lattice.cells])
            runs = core.sweep_cells(heading, arcs_cells, vertices, robot.offsets, reach, 1.0)
            cost = length * lattice.step + _cells_cost(built, runs, row, column)
            node = built.node(h, to_row, to_column)
            if np.isfinite(cost):
                bound = built.graph.estimate(node)
                star.start(node, cost=cost, bound=bound, edge=-1 - len(curves))
    return star, curves


def _cells_cost(built: BuiltLattice, runs: IntArray, row: int, column: int) -> float:
    lattice = built.lattice
    cell = lattice.corner + np.array([row, column]) * lattice.cells
    at = int(cell[1] * lattice.stride + cell[0])
    flat = flat_runs(runs, lattice.stride)
    low = at + int(flat.min(initial=0))
    high = at + int(flat.max(initial=0))
    if low < 0 or high >= len(lattice.cost_sums):
        return math.inf  # a curve that leaves the map
    blocked = lattice.blocked_sums
    if len(blocked) and core.swath_sum(blocked, flat, 0, len(flat), at) > 0.5:
        return math.inf
    return core.swath_sum(lattice.cost_sums, flat, 0, len(flat), at)


def path_arcs(
    built: BuiltLattice, tree: search.SearchTree, curves: list[FloatArray], node: int
) -> FloatArray:
    """(E, 2) length [m] and curvature [1/m] of the arcs of the path to ``node``."""
    edges = tree.path(node)[:, 1]
    parts = [np.zeros((0, 2))]
    for edge in edges.tolist():
        if edge >= 0:
            parts.append(built.motions.pieces[edge])
        elif edge < -1:
            parts.append(curves[-2 - edge])
    arcs: FloatArray = np.concatenate(parts) * np.array(
        [built.lattice.step, 1.0 / built.lattice.step]
    )
    return arcs


def sample_arcs(
    start: FloatArray, arcs: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses along (E, 2) arcs from a pose on, and the (N,) curvatures [1/m] to each."""
    turn = float(np.abs(arcs[:, 0] * arcs[:, 1]).sum())
    capacity = int(arcs[:, 0].sum() / spacing + turn / 0.1) + 2 * len(arcs) + 8
    poses = np.empty((capacity, 3))
    curvatures = np.zeros(capacity)
    poses[0] = start
    count = 1 + core.sample_pieces(start, arcs, spacing, poses[1:], curvatures[1:])
    return poses[:count], curvatures[:count]


def lay_path(
    built: BuiltLattice, arcs: FloatArray, world: World, config: LatticeConfig
) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses along arcs from the robot, and the (N,) curvatures that lead to them [1/m].

    The path is cut off where it reaches the goal, or the goal row of a lattice that ends before.
    """
    size = world.robot.circumscribed_radius
    spacing = SPACING * size
    poses, curvatures = sample_arcs(world.robot_pose, arcs, spacing)
    goal = world.navigation_goal
    if isinstance(goal, GoalLine):
        point, normal = built.finish(world)
        inside = np.flatnonzero((poses[:, :2] - point) @ normal >= -1e-9 * size)
    else:
        numbers = goal_numbers(goal, config.inset * size)
        inside = np.flatnonzero([core.in_goal(x, y, numbers) for x, y in poses[:, :2]])
    end = int(inside[0]) + 1 if len(inside) else len(poses)
    poses = poses[:end].copy()
    curvatures = curvatures[:end].copy()
    if isinstance(goal, GoalLine) and len(inside) and end > 1:
        _cut_at_line(poses, float(curvatures[-1]), spacing, point, normal)
    return poses, curvatures


def _cut_at_line(
    poses: FloatArray, curvature: float, spacing: float, point: FloatArray, normal: FloatArray
) -> None:
    """Put the last pose where the arc from the one before crosses a line, by bisection."""
    before = poses[-2]
    out = poses[-1]
    low = 0.0
    high = spacing
    for _ in range(50):
        middle = 0.5 * (low + high)
        core.along_arc(before, middle, curvature, out)
        if float((out[:2] - point) @ normal) < 0.0:
            low = middle
        else:
            high = middle
    core.along_arc(before, high, curvature, out)


def bare_path(poses: FloatArray, curvatures: FloatArray) -> SweptPath:
    """A path about which nothing is predicted."""
    return SweptPath(poses, curvatures, None, arc_lengths(poses), np.zeros(len(poses)))
