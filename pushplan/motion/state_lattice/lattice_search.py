"""From the robot into a lattice, and from what was found there to arcs."""

from __future__ import annotations

import math

import numpy as np

from pushplan.geometry.angles import wrap_angle
from pushplan.motion.state_lattice.built_lattice import BuiltLattice
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.motion.state_lattice.pose_lattice import bound_at, swath_sum, within
from pushplan.motion.state_lattice.primitives import connections
from pushplan.motion.state_lattice.swath_kernels import sweep_cells
from pushplan.motion.state_lattice.swaths import flat_runs
from pushplan.motion.time_slicing import go_on
from pushplan.search.astar import AStar
from pushplan.world.checks import FloatArray, IntArray

_NEAREST = 4  # headings of the lattice that a robot between two of them may turn to
_PATHS = 8  # paths to each of them
_SLACK = 0.8  # greatest turn beyond the change of heading [rad]


def open_search(built: BuiltLattice, builder: LatticeBuilder) -> tuple[AStar, list[FloatArray]]:
    """A search from the robot: from its node, or from where short curves lead to.

    Returns:
        The search, and for start edge -2 - i the (3, 2) arcs [steps] of curve i.
    """
    lattice = built.lattice
    motions = built.motions
    branching = int(np.diff(motions.first).max())
    star = AStar(lattice, built.size, branching)
    row, column, heading = built.start
    turns = np.abs(wrap_angle(motions.angles - heading))
    nearest = int(np.argmin(turns))
    if turns[nearest] < 1e-6:
        node = built.node(nearest, row, column)
        star.start(node, bound=float(bound_at(lattice, node)))
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
            if not within(lattice.planes, row, column, box):
                continue
            curves.append(np.array(arcs).reshape(3, 2))
            arcs_cells = curves[-1] * np.array([lattice.cells, 1.0 / lattice.cells])
            runs = sweep_cells(heading, arcs_cells, vertices, robot.offsets, reach, 1.0)
            cost = length * lattice.step + _cells_cost(built, runs, row, column)
            node = built.node(h, to_row, to_column)
            if np.isfinite(cost):
                bound = float(bound_at(lattice, node))
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
    if len(lattice.blocked_sums) and swath_sum(lattice.blocked_sums, flat, 0, len(flat), at) > 0.5:
        return math.inf
    return float(swath_sum(lattice.cost_sums, flat, 0, len(flat), at))


def path_arcs(
    built: BuiltLattice, star: AStar, curves: list[FloatArray], node: int | None = None
) -> FloatArray:
    """(E, 2) length [m] and curvature [1/m] of the arcs of the path to ``node``, or the goal."""
    _, edges = star.path() if node is None else star.path(node)
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
