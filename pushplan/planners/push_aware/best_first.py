"""Best-first search over driven arcs whose nodes carry the objects that they have pushed; compiled.

A hybrid-state A* (Dolgov, Thrun, Montemerlo and Diebel, "Path Planning for Autonomous Vehicles in
Unknown Semi-structured Environments", 2010) whose nodes hold, besides the pose, where the objects
are by then, as in PAMO* (Ren et al., arXiv 2410.18333). An edge costs m₀ times its length plus w
times the interaction work of driving it, which the interaction model tells. An edge that moves
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

from pushplan.compiled import copy_into, kernel
from pushplan.motion.arc_rollout import ArcMemory, make_arc_memory
from pushplan.motion.dubins import along_arc
from pushplan.motion.goal_region import in_goal
from pushplan.motion.path_problem import PathProblem
from pushplan.planners.push_aware.cost_to_go import CostToGo, length_to_go
from pushplan.planners.push_aware.push_tree import PushTree, drive
from pushplan.search.astar import AStar, register
from pushplan.world.checks import FloatArray, IntArray


class Branching(NamedTuple):
    """Parameters of the expansion of nodes."""

    curvatures: FloatArray  # (C,) [1/m]
    length: float  # of an edge [m]
    inflation: float  # of the heuristic, in the order of the queue
    pruning_factor: float  # on the length that is left, where a node is given up for its cost
    masses: FloatArray  # (K,) of the objects as the search weighs them [kg]


class PushLattice(NamedTuple):
    """Poses and pushed objects, as a lattice of `pushplan.search.astar`."""

    tree: PushTree
    table: CostToGo
    branching: Branching
    bound: float  # Cost above which nodes are of no use [kg m]
    problem: PathProblem
    memory: ArcMemory


def make_search(
    tree: PushTree, table: CostToGo, branching: Branching, bound: float, problem: PathProblem
) -> AStar:
    """A search from the root of ``tree``, which is planted; arguments as in `PushLattice`."""
    lattice = PushLattice(tree, table, branching, bound, problem, make_arc_memory(problem))
    star = AStar(lattice, 2 * len(tree.costs), len(branching.curvatures))
    star.start(1)
    return star


@kernel
def _signature(objects: FloatArray, start: FloatArray, radii: FloatArray, count: int) -> int:
    """Fold the set of objects that have been moved into a number below ``count``."""
    if count == 1:
        return 0
    code = np.int64(0)
    for k in range(objects.shape[0]):
        dx = objects[k, 0] - start[k, 0]
        dy = objects[k, 1] - start[k, 1]
        if dx * dx + dy * dy > (0.1 * radii[k]) ** 2:
            code = code * 31 + k + 1
    return int(code % count)


@kernel
def _cell(tree: PushTree, table: CostToGo, pose: FloatArray) -> tuple[int, int, int]:
    """Row, column and heading of the cell of a pose."""
    rows, cols, headings = tree.best.shape[:3]
    r = min(max(int((pose[1] - table.origin[1]) / table.cell), 0), rows - 1)
    c = min(max(int((pose[0] - table.origin[0]) / table.cell), 0), cols - 1)
    k = int(np.floor(pose[2] / (2.0 * np.pi) * headings + 0.5)) % headings
    return r, c, k


@kernel
def _best_there(tree: PushTree, node: int, table: CostToGo, radii: FloatArray) -> float:
    """Least cost of a node in the cell of this one."""
    r, c, k = _cell(tree, table, tree.poses[node])
    moved = tree.objects[tree.rows[node]]
    best: float = tree.best[r, c, k, _signature(moved, tree.objects[0], radii, tree.best.shape[3])]
    return best


@kernel
def _settle(lattice: PushLattice, node: int, length: float) -> bool:
    """Write down what a node really costs; False if its cell has a cheaper one."""
    tree = lattice.tree
    problem = lattice.problem
    memory = lattice.memory
    parent = tree.parents[node]
    work = 0.0
    for i in range(memory.moved.shape[0]):
        work += memory.moved[i] * lattice.branching.masses[i]
    cost = tree.costs[parent] + problem.robot_mass * length + problem.push_weight * work
    row = tree.rows[parent]
    if work > 0.0:
        row = tree.counts[1]
        copy_into(tree.objects[row], memory.objects)
    tree.rows[node] = row
    goal = in_goal(tree.poses[node, 0], tree.poses[node, 1], problem.goal)
    if not goal:
        r, c, k = _cell(tree, lattice.table, tree.poses[node])
        code = _signature(
            tree.objects[row], tree.objects[0], problem.contacts.radii, tree.best.shape[3]
        )
        if cost >= tree.best[r, c, k, code]:
            return False
        tree.best[r, c, k, code] = cost
    if work > 0.0:
        tree.counts[1] += 1
    # only work and a shorter arc change what was guessed
    tree.estimates[node] += max(cost - tree.costs[node], 0.0)
    if goal:
        tree.estimates[node] = max(cost, tree.estimates[parent])
    tree.costs[node] = cost
    tree.arcs[node, 0] = length
    return True


@kernel
def _drive_to(lattice: PushLattice, node: int) -> bool:
    """Drive a node's arc; False if that leads nowhere, or memory is full."""
    tree = lattice.tree
    tree.counts[3] += 1
    if tree.counts[1] == tree.objects.shape[0]:
        tree.counts[2] = 1
        return False
    length = drive(tree, node, lattice.problem, lattice.memory)
    if length == 0.0 or not _settle(lattice, node, length):
        return False
    return bool(tree.costs[node] < lattice.bound)


@kernel
def _successors(
    lattice: PushLattice, number: int, numbers: IntArray, costs: FloatArray, edges: IntArray
) -> int:
    """Drive an arc; or list those that leave a node, as if they pushed nothing."""
    tree = lattice.tree
    table = lattice.table
    branching = lattice.branching
    m0 = lattice.problem.robot_mass
    goal = lattice.problem.goal
    length = branching.length
    node = number >> 1
    if number % 2 == 0:
        if not _drive_to(lattice, node):
            return 0
        numbers[0] = number + 1
        edges[0] = 0
        costs[0] = tree.costs[node] - tree.costs[tree.parents[node]]
        return 1
    if tree.counts[0] + branching.curvatures.shape[0] > tree.poses.shape[0]:
        tree.counts[2] = 1
        return 0
    if tree.parents[node] >= 0:
        there = _best_there(tree, node, table, lattice.problem.contacts.radii)
        if tree.costs[node] > there * (1.0 + 1e-12):
            return 0  # a cheaper node has taken its cell since
    cost = tree.costs[node] + m0 * length
    one = tree.best.shape[3] == 1
    found = 0
    for curve in range(branching.curvatures.shape[0]):
        curvature = branching.curvatures[curve]
        new = tree.counts[0]
        pose = tree.poses[new]
        along_arc(tree.poses[node], length, curvature, pose)
        left = 0.0
        if not in_goal(pose[0], pose[1], goal):
            left = length_to_go(table, pose[0], pose[1], pose[2])
            if one:
                r, c, k = _cell(tree, table, pose)
                if cost >= tree.best[r, c, k, 0]:
                    continue
        if not cost + branching.pruning_factor * m0 * left < lattice.bound:
            continue
        tree.counts[0] += 1
        tree.costs[new] = cost
        tree.estimates[new] = max(cost + branching.inflation * m0 * left, tree.estimates[node])
        tree.parents[new] = node
        tree.arcs[new, 0] = length
        tree.arcs[new, 1] = curvature
        tree.rows[new] = -1
        numbers[found] = 2 * new
        costs[found] = 0.0
        edges[found] = 0
        found += 1
    return found


@kernel
def _estimate(lattice: PushLattice, number: int) -> float:
    """Return the estimated cost to go; the arc of a guess is paid when it is driven."""
    tree = lattice.tree
    node = number >> 1
    paid = node
    if number % 2 == 0:
        paid = tree.parents[node]
    left: float = tree.estimates[node] - tree.costs[paid]
    return left


@kernel
def _reached(lattice: PushLattice, number: int) -> bool:
    """Return True if a driven node lies in the goal."""
    pose = lattice.tree.poses[number >> 1]
    return number % 2 == 1 and in_goal(pose[0], pose[1], lattice.problem.goal)


register(PushLattice, _successors, _estimate, _reached)
