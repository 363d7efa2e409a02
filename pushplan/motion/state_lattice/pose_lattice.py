"""`PoseLattice`: places and headings joined by motion primitives, which cost what they cover."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.search.astar import register
from pushplan.world.checks import FloatArray, IntArray


class PoseLattice(NamedTuple):
    """A lattice of H headings over rows ahead and columns across it.

    Node (h, u, v) has the number (h * rows + u) * columns + v. Lengths are in metres and places in
    steps, unless stated otherwise; costs are in metres of travel.
    """

    rows: int
    columns: int
    step: float  # Distance of neighbouring places [m]
    cells: int  # Cells of the map in a step
    corner: IntArray  # (2,) cell of the map on which the node of row 0 and column 0 lies
    first: IntArray  # (H + 1,) where the primitives of each heading start
    ends: IntArray  # (P, 3) rows, columns [steps] and heading at the end of each primitive
    lengths: FloatArray  # (P,) [m]
    boxes: FloatArray
    """(P, 4) least and greatest row and column of the robot's origin along each primitive."""
    run_first: IntArray  # (P + 1,) where the runs of each primitive start
    runs: IntArray
    """(R, 2) first cell and last cell + 1 of the cells that it newly covers, in columns, as offsets
    in the flattened sums below; the map is so large that no swath leaves it."""
    cost_sums: FloatArray
    """(map columns * (map rows + 1),) sums of the costs of each column before each row [m]."""
    blocked_sums: FloatArray
    """The same for cells that must not be covered; (0,) where there are none."""
    stride: int  # Map rows + 1
    planes: FloatArray  # (B, 3) a, b, c: the robot's origin keeps a u + b v <= c [steps]
    goal: FloatArray
    """(4,) 0 and the row of the goal line; or 1, row, column and radius of the goal disc."""
    row_bounds: FloatArray  # (H, rows) length of the path from each row and heading to the line [m]
    place_costs: FloatArray
    """(rows, columns) bound or estimate of the cost from each place to the line [m]."""
    inflation: float  # Factor on both


@kernel
def place_of(lattice: PoseLattice, node: int) -> tuple[int, int, int]:
    """Heading, row and column of a node."""
    rest = node // lattice.columns
    v = node % lattice.columns
    return rest // lattice.rows, rest % lattice.rows, v


@kernel
def swath_sum(sums: FloatArray, runs: IntArray, begin: int, end: int, at: int) -> float:
    """Sum of a map over the runs ``begin`` to ``end`` - 1 around the cell at the offset ``at``."""
    total = 0.0
    for r in range(begin, end):
        total += sums[at + runs[r, 1]] - sums[at + runs[r, 0]]
    return total


@kernel
def within(planes: FloatArray, u: int, v: int, box: FloatArray) -> bool:
    """Return True if a path with its origin in ``box`` around (u, v) keeps to all half planes."""
    for i in range(planes.shape[0]):
        a = planes[i, 0]
        b = planes[i, 1]
        worst = a * (u + (box[1] if a > 0.0 else box[0]))
        worst += b * (v + (box[3] if b > 0.0 else box[2]))
        if worst > planes[i, 2]:
            return False
    return True


@kernel
def edge_cost(lattice: PoseLattice, u: int, v: int, p: int) -> float:
    """Length plus cost of primitive ``p`` from place (u, v) [m]; infinite where it is closed."""
    at = (lattice.corner[1] + v * lattice.cells) * lattice.stride
    at += lattice.corner[0] + u * lattice.cells
    begin = lattice.run_first[p]
    end = lattice.run_first[p + 1]
    if lattice.blocked_sums.shape[0] > 0:
        if swath_sum(lattice.blocked_sums, lattice.runs, begin, end, at) > 0.5:
            return np.inf
    covered = swath_sum(lattice.cost_sums, lattice.runs, begin, end, at)
    cost: float = lattice.lengths[p] + covered
    return cost


@kernel
def successors(
    lattice: PoseLattice, node: int, nodes: IntArray, costs: FloatArray, edges: IntArray
) -> int:
    """List the successors of a node; see `astar.expand`."""
    h, u, v = place_of(lattice, node)
    count = 0
    for p in range(lattice.first[h], lattice.first[h + 1]):
        to_u = u + lattice.ends[p, 0]
        to_v = v + lattice.ends[p, 1]
        if to_u < 0 or to_u >= lattice.rows or to_v < 0 or to_v >= lattice.columns:
            continue
        if not within(lattice.planes, u, v, lattice.boxes[p]):
            continue
        cost = edge_cost(lattice, u, v, p)
        if cost == np.inf:
            continue
        du = lattice.ends[p, 0]
        dv = lattice.ends[p, 1]
        straight = np.sqrt(float(du * du + dv * dv)) * lattice.step
        if (
            lattice.goal[0] == 0.0
            and to_u > lattice.goal[1]
            and lattice.lengths[p] < 1.000001 * straight
        ):
            # a line is driven only as far as the goal
            cost -= lattice.lengths[p] * (to_u - lattice.goal[1]) / du
        nodes[count] = (lattice.ends[p, 2] * lattice.rows + to_u) * lattice.columns + to_v
        costs[count] = cost
        edges[count] = p
        count += 1
    return count


@kernel
def bound_at(lattice: PoseLattice, node: int) -> float:
    """Bound or estimate of the cost from a node to the goal [m], times the inflation."""
    h, u, v = place_of(lattice, node)
    if lattice.goal[0] == 0.0:
        bound: float = max(lattice.row_bounds[h, u], lattice.place_costs[u, v])
        return lattice.inflation * bound
    gap = np.sqrt((u - lattice.goal[1]) ** 2 + (v - lattice.goal[2]) ** 2) - lattice.goal[3]
    away: float = lattice.inflation * max(0.0, gap) * lattice.step
    return away


@kernel
def reached(lattice: PoseLattice, node: int) -> bool:
    """Return True if a node lies in the goal."""
    _, u, v = place_of(lattice, node)
    if lattice.goal[0] == 0.0:
        arrived: bool = u >= lattice.goal[1] - 1e-9
    else:
        gap = (u - lattice.goal[1]) ** 2 + (v - lattice.goal[2]) ** 2
        arrived = gap <= lattice.goal[3] ** 2 + 1e-9
    return arrived


register(PoseLattice, successors, bound_at, reached)
