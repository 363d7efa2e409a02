"""From the robot into a lattice, and from what was found there to the poses of a path."""

from __future__ import annotations

import math

import numpy as np

from pushplan.motion.dubins import along_arc, sample_pieces
from pushplan.motion.goal_region import goal_numbers, in_goal
from pushplan.motion.state_lattice.pose_lattice import bound_at, flat_runs, swath_sum, within
from pushplan.motion.state_lattice.swaths import sweep_cells
from pushplan.planners.ship_lattice.build import BuiltLattice, LatticeBuilder
from pushplan.planners.ship_lattice.ship_lattice_config import ShipLatticeConfig
from pushplan.search.astar import AStar
from pushplan.world import GoalLine, World
from pushplan.world.checks import FloatArray, IntArray


def open_search(built: BuiltLattice, builder: LatticeBuilder) -> tuple[AStar, list[FloatArray]]:
    """A search from the robot: from its node, or from where short curves lead to.

    Returns:
        The search, and for start edge -2 - i the (3, 2) arcs [steps] of curve i.
    """
    lattice, motions = built.lattice, built.motions
    branching = int(np.diff(motions.first).max())
    star = AStar(lattice, built.size, branching)
    row, column, heading = built.start
    turns = np.abs((motions.angles - heading + np.pi) % (2.0 * np.pi) - np.pi)
    nearest = int(np.argmin(turns))
    if turns[nearest] < 1e-6:
        node = built.node(nearest, row, column)
        star.start(node, bound=float(bound_at(lattice, node)))
        return star, []
    robot = builder.world.robot
    vertices = robot.vertices / builder.cell
    reach = robot.circumscribed_radius / builder.cell
    curves: list[FloatArray] = []
    for h, rows in builder.ways_in():
        for way in rows:
            to_row, to_column = row + round(way[1]), column + round(way[2])
            if not (0 <= to_row < lattice.rows and 0 <= to_column < lattice.columns):
                continue
            pieces = way[3:].reshape(3, 2)
            box = np.array([min(way[1], 0), max(way[1], 0), min(way[2], 0), max(way[2], 0)])
            if not within(lattice.planes, row, column, box):
                continue
            arcs = pieces * np.array([lattice.cells, 1.0 / lattice.cells])
            runs = sweep_cells(heading, arcs, vertices, robot.offsets, reach, 1.0)
            cost = way[0] * lattice.step + _cells_cost(built, runs, row, column)
            node = built.node(h, to_row, to_column)
            curves.append(pieces)
            if np.isfinite(cost):
                bound = float(bound_at(lattice, node))
                star.start(node, cost=cost, bound=bound, edge=-1 - len(curves))
    return star, curves


def _cells_cost(built: BuiltLattice, runs: IntArray, row: int, column: int) -> float:
    lattice = built.lattice
    cell = lattice.corner + np.array([row, column]) * lattice.cells
    at = int(cell[1] * lattice.stride + cell[0])
    flat = flat_runs(runs, lattice.stride)
    low, high = at + int(flat.min(initial=0)), at + int(flat.max(initial=0))
    if low < 0 or high >= len(lattice.price_sums):
        return math.inf  # a curve that leaves the map
    if len(lattice.blocked_sums) and swath_sum(lattice.blocked_sums, flat, 0, len(flat), at) > 0.5:
        return math.inf
    return float(swath_sum(lattice.price_sums, flat, 0, len(flat), at))


def path_arcs(built: BuiltLattice, star: AStar, curves: list[FloatArray]) -> FloatArray:
    """(E, 2) length [m] and curvature [1/m] of the arcs of the path that was found."""
    _, edges = star.path()
    parts = []
    for edge in edges.tolist():
        if edge >= 0:
            parts.append(built.motions.pieces[edge])
        elif edge < -1:
            parts.append(curves[-2 - edge])
    scale = np.array([built.lattice.step, 1.0 / built.lattice.step])
    return np.concatenate(parts) * scale if parts else np.zeros((0, 2))


def lay_path(
    built: BuiltLattice, arcs: FloatArray, world: World, config: ShipLatticeConfig
) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses along arcs from the robot, and the (N,) curvatures that lead to them [1/m].

    The path is cut off where it reaches the goal, or the goal row of a lattice that ends before.
    """
    size = world.robot.circumscribed_radius
    spacing = config.spacing * size
    room = int(arcs[:, 0].sum() / spacing + np.abs(arcs[:, 0] * arcs[:, 1]).sum() / 0.1)
    poses, bends = np.empty((room + 2 * len(arcs) + 8, 3)), np.zeros(room + 2 * len(arcs) + 8)
    poses[0] = world.robot_pose
    count = 1 + sample_pieces(world.robot_pose, arcs, spacing, poses[1:], bends[1:])
    poses, bends = poses[:count], bends[:count]
    goal = world.navigation_goal
    if isinstance(goal, GoalLine):
        point, normal = built.finish(world)
        inside = np.flatnonzero((poses[:, :2] - point) @ normal >= -1e-9)
    else:
        numbers = goal_numbers(goal, config.inset * size)
        inside = np.array([i for i in range(count) if in_goal(poses[i, 0], poses[i, 1], numbers)])
    end = int(inside[0]) + 1 if len(inside) else count
    poses, bends = poses[:end].copy(), bends[:end].copy()
    if isinstance(goal, GoalLine) and len(inside) and end > 1:
        cut_at_line(poses[-2], float(bends[-1]), spacing, point, normal, poses[-1])
    return poses, bends


def cut_at_line(
    before: FloatArray,
    bend: float,
    spacing: float,
    point: FloatArray,
    normal: FloatArray,
    out: FloatArray,
) -> None:
    """Put the pose where an arc from ``before`` crosses a line into ``out`` (3,), by bisection."""
    low, high = 0.0, spacing
    for _ in range(50):
        middle = 0.5 * (low + high)
        along_arc(before, middle, bend, out)
        if float((out[:2] - point) @ normal) < 0.0:
            low = middle
        else:
            high = middle
    along_arc(before, high, bend, out)
