"""Best-first search over driven arcs whose nodes carry the objects that they have pushed; compiled.

A hybrid-state A* (Dolgov, Thrun, Montemerlo and Diebel, "Path Planning for Autonomous Vehicles in
Unknown Semi-structured Environments", 2010) whose nodes hold, besides the pose, where the objects
are by then, as in PAMO* (Ren et al., arXiv 2410.18333). An edge costs m₀ times its length plus w
times the interaction work of driving it, which the quasi-static kernels tell. An edge that moves
nothing shares the objects of its parent, so that objects at rest cost neither time nor memory.
Edges are driven only when they come first in the queue (Cohen, Phillips and Likhachev, "Planning
Single-arm Manipulations with N-arm Robots", 2014: lazy weighted A*); until then they count as if
they pushed nothing.

To the A* of `pushplan.search.astar` it is a lattice whose nodes are made as it goes.
Node k of the tree has two numbers there: 2 k is its arc as guessed, whose only successor is
2 k + 1, the arc as driven; from that the next arcs branch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction.kernels import Bodies, Scratch, Settings, make_scratch
from pushplan.motion.collision import Footprint, Obstacles
from pushplan.motion.dubins import along_arc
from pushplan.motion.shortcutting import Pricing, in_goal
from pushplan.planners.push_aware.cost_to_go import CostToGo, length_to_go
from pushplan.planners.push_aware.nodes import Nodes, drive
from pushplan.search.astar import AStar, register
from pushplan.world.checks import FloatArray, IntArray


class Branching(NamedTuple):
    """How nodes are expanded."""

    curvatures: FloatArray
    """(C,) [1/m]"""
    length: float
    """of an edge [m]"""
    greed: float
    """factor on the length that is left, in the order of the queue"""
    trust: float
    """factor on the length that is left, where a node is given up for its cost"""
    masses: FloatArray
    """(K,) of the objects as the search prices them [kg]"""


class PushLattice(NamedTuple):
    """Poses and pushed objects, as a lattice of `pushplan.search.astar`."""

    nodes: Nodes
    table: CostToGo
    branching: Branching
    bound: float
    """cost above which nodes are of no use [kg m]"""
    pricing: Pricing
    shape: Footprint
    """with its margin"""
    among: Obstacles
    """the walls"""
    bodies: Bodies
    settings: Settings
    scratch: Scratch
    corners: FloatArray
    poses: FloatArray
    objects: FloatArray
    moved: FloatArray


def make_search(
    nodes: Nodes,
    table: CostToGo,
    branching: Branching,
    bound: float,
    pricing: Pricing,
    shape: Footprint,
    among: Obstacles,
    bodies: Bodies,
    settings: Settings,
) -> AStar:
    """A search from the root of ``nodes``, which is planted; arguments as in `PushLattice`."""
    count = nodes.objects.shape[1]
    lattice = PushLattice(
        nodes,
        table,
        branching,
        bound,
        pricing,
        shape,
        among,
        bodies,
        settings,
        make_scratch(bodies),
        np.empty_like(shape.vertices),
        np.empty((2, 3)),
        np.empty((count, 3)),
        np.empty(count),
    )
    star = AStar(lattice, 2 * len(nodes.costs), len(branching.curvatures))
    star.start(1)
    return star


@kernel(allocates=True)
def _signature(objects: FloatArray, start: FloatArray, bodies: Bodies, count: int) -> int:
    """Which objects have been moved, folded into a number below ``count``."""
    if count == 1:
        return 0
    code = np.int64(0)
    for k in range(objects.shape[0]):
        dx, dy = objects[k, 0] - start[k, 0], objects[k, 1] - start[k, 1]
        if dx * dx + dy * dy > (0.1 * bodies.radii[k]) ** 2:
            code = code * 31 + k + 1
    return int(code % count)


@kernel(allocates=True)
def _cell(nodes: Nodes, table: CostToGo, pose: FloatArray) -> tuple[int, int, int]:
    rows, cols, headings = nodes.best.shape[:3]
    r = min(max(int((pose[1] - table.origin[1]) / table.cell), 0), rows - 1)
    c = min(max(int((pose[0] - table.origin[0]) / table.cell), 0), cols - 1)
    k = int(np.floor(pose[2] / (2.0 * np.pi) * headings + 0.5)) % headings
    return r, c, k


@kernel(allocates=True)
def _best_there(nodes: Nodes, node: int, table: CostToGo, bodies: Bodies) -> float:
    """Least cost of a node in the cell of this one."""
    r, c, k = _cell(nodes, table, nodes.poses[node])
    moved = nodes.objects[nodes.rows[node]]
    best: float = nodes.best[
        r, c, k, _signature(moved, nodes.objects[0], bodies, nodes.best.shape[3])
    ]
    return best


@kernel(allocates=True)
def _settle(lattice: PushLattice, node: int, length: float) -> bool:
    """Write down what a node really costs; False if its cell has a cheaper one."""
    nodes, bodies, pricing = lattice.nodes, lattice.bodies, lattice.pricing
    objects, moved = lattice.objects, lattice.moved
    parent = nodes.parents[node]
    work = 0.0
    for i in range(moved.shape[0]):
        work += moved[i] * lattice.branching.masses[i]
    cost = nodes.costs[parent] + pricing.robot_mass * length + pricing.push_weight * work
    row = nodes.rows[parent]
    if work > 0.0:
        row = nodes.counts[1]
        nodes.objects[row] = objects
    nodes.rows[node] = row
    goal = in_goal(nodes.poses[node, 0], nodes.poses[node, 1], pricing.goal)
    if not goal:
        r, c, k = _cell(nodes, lattice.table, nodes.poses[node])
        code = _signature(nodes.objects[row], nodes.objects[0], bodies, nodes.best.shape[3])
        if cost >= nodes.best[r, c, k, code]:
            return False
        nodes.best[r, c, k, code] = cost
    if work > 0.0:
        nodes.counts[1] += 1
    # only work and a shorter arc change what was guessed
    nodes.estimates[node] += max(cost - nodes.costs[node], 0.0)
    if goal:
        nodes.estimates[node] = max(cost, nodes.estimates[parent])
    nodes.costs[node] = cost
    nodes.arcs[node, 0] = length
    return True


@kernel(allocates=True)
def _drive_to(lattice: PushLattice, node: int) -> bool:
    """Drive a node's arc; False if that leads nowhere, or memory is full."""
    nodes = lattice.nodes
    nodes.counts[3] += 1
    if nodes.counts[1] == nodes.objects.shape[0]:
        nodes.counts[2] = 1
        return False
    length = drive(
        nodes, node, lattice.pricing, lattice.shape, lattice.among, lattice.bodies,
        lattice.settings, lattice.scratch, lattice.corners, lattice.poses, lattice.objects,
        lattice.moved,
    )  # fmt: skip
    if length == 0.0 or not _settle(lattice, node, length):
        return False
    return bool(nodes.costs[node] < lattice.bound)


@kernel(allocates=True)
def _successors(
    lattice: PushLattice, number: int, numbers: IntArray, costs: FloatArray, edges: IntArray
) -> int:
    """Drive an arc; or list those that leave a node, as if they pushed nothing."""
    nodes, table, branching = lattice.nodes, lattice.table, lattice.branching
    m0, length = lattice.pricing.robot_mass, lattice.branching.length
    node = number >> 1
    if number % 2 == 0:
        if not _drive_to(lattice, node):
            return 0
        numbers[0], edges[0] = number + 1, 0
        costs[0] = nodes.costs[node] - nodes.costs[nodes.parents[node]]
        return 1
    if nodes.counts[0] + branching.curvatures.shape[0] > nodes.poses.shape[0]:
        nodes.counts[2] = 1
        return 0
    if nodes.parents[node] >= 0:
        there = _best_there(nodes, node, table, lattice.bodies)
        if nodes.costs[node] > there + 1e-12:
            return 0  # a cheaper node has taken its cell since
    cost = nodes.costs[node] + m0 * length
    one = nodes.best.shape[3] == 1
    found = 0
    for curvature in branching.curvatures:
        new = nodes.counts[0]
        pose = nodes.poses[new]
        along_arc(nodes.poses[node], length, curvature, pose)
        left = 0.0
        if not in_goal(pose[0], pose[1], lattice.pricing.goal):
            left = length_to_go(table, pose[0], pose[1], pose[2])
            if one:
                r, c, k = _cell(nodes, table, pose)
                if cost >= nodes.best[r, c, k, 0]:
                    continue
        if not cost + branching.trust * m0 * left < lattice.bound:
            continue
        nodes.counts[0] += 1
        nodes.costs[new] = cost
        nodes.estimates[new] = max(cost + branching.greed * m0 * left, nodes.estimates[node])
        nodes.parents[new] = node
        nodes.arcs[new, 0], nodes.arcs[new, 1] = length, curvature
        nodes.rows[new] = -1
        numbers[found], costs[found], edges[found] = 2 * new, 0.0, 0
        found += 1
    return found


@kernel(allocates=True)
def _estimate(lattice: PushLattice, number: int) -> float:
    """What is left to pay; the arc of a guess is paid when it is driven."""
    nodes, node = lattice.nodes, number >> 1
    paid = nodes.costs[node] if number % 2 == 1 else nodes.costs[nodes.parents[node]]
    left: float = nodes.estimates[node] - paid
    return left


@kernel(allocates=True)
def _reached(lattice: PushLattice, number: int) -> bool:
    pose = lattice.nodes.poses[number >> 1]
    return number % 2 == 1 and in_goal(pose[0], pose[1], lattice.pricing.goal)


register(PushLattice, _successors, _estimate, _reached)
