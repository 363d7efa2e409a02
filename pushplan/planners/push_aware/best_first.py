"""Best-first search over driven arcs whose nodes carry the objects that they have pushed; compiled.

A hybrid-state A* (Dolgov, Thrun, Montemerlo and Diebel, "Path Planning for Autonomous Vehicles in
Unknown Semi-structured Environments", 2010) whose nodes hold, besides the pose, where the objects
are by then, as in PAMO* (Ren et al., arXiv 2410.18333). An edge costs m₀ times its length plus w
times the interaction work of driving it, which the quasi-static kernels tell. An edge that moves
nothing shares the objects of its parent, so that objects at rest cost neither time nor memory.
Edges are driven only when they come first in the queue (Cohen, Phillips and Likhachev, "Planning
Single-arm Manipulations with N-arm Robots", 2014: lazy weighted A*); until then they count as if
they pushed nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from pushplan.interaction.kernels import Bodies, Scratch, Settings, advance, make_scratch
from pushplan.planners.kinodynamic.collision import Footprint, Obstacles, is_free
from pushplan.planners.kinodynamic.dubins import along_arc, step_along
from pushplan.planners.kinodynamic.improve import Pricing, in_goal
from pushplan.planners.push_aware.cost_to_go import CostToGo, length_to_go
from pushplan.world.checks import FloatArray, IntArray


class Nodes(NamedTuple):
    """The search tree and its queue, in memory that is made once for a call."""

    poses: FloatArray
    """(N, 3)"""
    costs: FloatArray
    """(N,) m₀ l₀ + w Σ mᵢ lᵢ so far [kg m]"""
    estimates: FloatArray
    """(N,) the same for the whole path through the node"""
    parents: IntArray
    """(N,) -1 at the root"""
    arcs: FloatArray
    """(N, 2) length [m] and curvature [1/m] of the arc that leads to the node"""
    rows: IntArray
    """(N,) which row of ``objects`` holds; -1 while the arc to the node has not been driven"""
    objects: FloatArray
    """(M, K, 3)"""
    queue: IntArray
    """(N,) binary heap of nodes by estimate"""
    best: FloatArray
    """(rows, columns, headings, signatures) least cost of a node in each cell"""
    counts: IntArray
    """(4,) nodes, rows of objects, length of the queue, arcs driven"""


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


@njit(cache=True, nogil=True)
def _push(nodes: Nodes, node: int) -> None:
    """Put a node into the queue."""
    queue, key = nodes.queue, nodes.estimates
    at = nodes.counts[2]
    nodes.counts[2] += 1
    queue[at] = node
    while at > 0:
        above = (at - 1) // 2
        if key[queue[above]] <= key[queue[at]]:
            break
        queue[above], queue[at] = queue[at], queue[above]
        at = above


@njit(cache=True, nogil=True)
def _pop(nodes: Nodes) -> int:
    """Take the node of least estimate out of the queue."""
    queue, key = nodes.queue, nodes.estimates
    first = int(queue[0])
    nodes.counts[2] -= 1
    count = nodes.counts[2]
    queue[0] = queue[count]
    at = 0
    while True:
        below = 2 * at + 1
        if below >= count:
            break
        if below + 1 < count and key[queue[below + 1]] < key[queue[below]]:
            below += 1
        if key[queue[at]] <= key[queue[below]]:
            break
        queue[below], queue[at] = queue[at], queue[below]
        at = below
    return first


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _cell(nodes: Nodes, table: CostToGo, pose: FloatArray) -> tuple[int, int, int]:
    rows, cols, headings = nodes.best.shape[:3]
    r = min(max(int((pose[1] - table.origin[1]) / table.cell), 0), rows - 1)
    c = min(max(int((pose[0] - table.origin[0]) / table.cell), 0), cols - 1)
    k = int(np.floor(pose[2] / (2.0 * np.pi) * headings + 0.5)) % headings
    return r, c, k


@njit(cache=True, nogil=True)
def plant(nodes: Nodes, pose: FloatArray, objects: FloatArray, estimate: float) -> None:
    """Begin a search at ``pose`` (3,) with the objects at ``objects`` (K, 3)."""
    nodes.best[:] = np.inf
    nodes.poses[0] = pose
    nodes.costs[0] = 0.0
    nodes.estimates[0] = estimate
    nodes.parents[0] = -1
    nodes.rows[0] = 0
    nodes.objects[0] = objects
    nodes.counts[0] = 1
    nodes.counts[1] = 1
    nodes.counts[2] = 0
    nodes.counts[3] = 0
    _push(nodes, 0)


@njit(cache=True, nogil=True)
def _drive(
    nodes: Nodes,
    node: int,
    pricing: Pricing,
    shape: Footprint,
    among: Obstacles,
    bodies: Bodies,
    settings: Settings,
    scratch: Scratch,
    corners: FloatArray,
    poses: FloatArray,
    objects: FloatArray,
    moved: FloatArray,
) -> float:
    """Drive the arc to a node, ``objects`` and ``moved`` receive what that does.

    Returns:
        The length driven [m]: less than the arc's where it comes into the goal before its end, 0
        where it is blocked.
    """
    parent = nodes.parents[node]
    start = nodes.poses[parent]
    longest, curvature = float(nodes.arcs[node, 0]), float(nodes.arcs[node, 1])
    steps = int(np.ceil(longest / step_along(curvature, pricing.spacing)))
    objects[:] = nodes.objects[nodes.rows[parent]]
    moved[:] = 0.0
    poses[1] = start
    for step in range(1, steps + 1):
        length = longest * step / steps
        along_arc(start, length, curvature, poses[0])
        if not is_free(poses[0], shape, among, corners):
            return 0.0
        if not advance(poses[1], poses[0], objects, moved, bodies, settings, scratch):
            return 0.0
        if in_goal(poses[0, 0], poses[0, 1], pricing.goal):
            nodes.poses[node] = poses[0]
            return length
        poses[1] = poses[0]
    return longest


@njit(cache=True, nogil=True)
def _best_there(nodes: Nodes, node: int, table: CostToGo, bodies: Bodies) -> float:
    """Least cost of a node in the cell of this one."""
    r, c, k = _cell(nodes, table, nodes.poses[node])
    moved = nodes.objects[nodes.rows[node]]
    best: float = nodes.best[
        r, c, k, _signature(moved, nodes.objects[0], bodies, nodes.best.shape[3])
    ]
    return best


@njit(cache=True, nogil=True)
def _settle(
    nodes: Nodes,
    node: int,
    length: float,
    objects: FloatArray,
    moved: FloatArray,
    pricing: Pricing,
    table: CostToGo,
    bodies: Bodies,
) -> bool:
    """Write down what a node really costs; False if its cell has a cheaper one."""
    parent = nodes.parents[node]
    work = 0.0
    for i in range(moved.shape[0]):
        work += moved[i] / bodies.inverse_masses[i]
    cost = nodes.costs[parent] + pricing.robot_mass * length + pricing.push_weight * work
    row = nodes.rows[parent]
    if work > 0.0:
        row = nodes.counts[1]
        nodes.objects[row] = objects
    nodes.rows[node] = row
    goal = in_goal(nodes.poses[node, 0], nodes.poses[node, 1], pricing.goal)
    if not goal:
        r, c, k = _cell(nodes, table, nodes.poses[node])
        code = _signature(nodes.objects[row], nodes.objects[0], bodies, nodes.best.shape[3])
        if cost >= nodes.best[r, c, k, code]:
            return False
        nodes.best[r, c, k, code] = cost
    if work > 0.0:
        nodes.counts[1] += 1
    # only work and a shorter arc change what was guessed
    gain = cost - nodes.costs[node]
    nodes.estimates[node] = max(nodes.estimates[node], nodes.estimates[node] + gain)
    if goal:
        nodes.estimates[node] = max(cost, nodes.estimates[parent])
    nodes.costs[node] = cost
    nodes.arcs[node, 0] = length
    return True


@njit(cache=True, nogil=True)
def _branch(
    nodes: Nodes,
    node: int,
    bound: float,
    table: CostToGo,
    branching: Branching,
    pricing: Pricing,
) -> None:
    """Queue the arcs that leave a node as if they pushed nothing; what they push is told later."""
    m0, length = pricing.robot_mass, branching.length
    cost = nodes.costs[node] + m0 * length
    one = nodes.best.shape[3] == 1
    for curvature in branching.curvatures:
        new = nodes.counts[0]
        pose = nodes.poses[new]
        along_arc(nodes.poses[node], length, curvature, pose)
        left = 0.0
        if not in_goal(pose[0], pose[1], pricing.goal):
            left = length_to_go(table, pose[0], pose[1], pose[2])
            if one:
                r, c, k = _cell(nodes, table, pose)
                if cost >= nodes.best[r, c, k, 0]:
                    continue
        if not cost + branching.trust * m0 * left < bound:
            continue
        estimate = max(cost + branching.greed * m0 * left, nodes.estimates[node])
        nodes.counts[0] += 1
        nodes.costs[new] = cost
        nodes.estimates[new] = estimate
        nodes.parents[new] = node
        nodes.arcs[new, 0], nodes.arcs[new, 1] = length, curvature
        nodes.rows[new] = -1
        _push(nodes, new)


@njit(cache=True, nogil=True)
def expand(
    nodes: Nodes,
    expansions: int,
    bound: float,
    table: CostToGo,
    branching: Branching,
    pricing: Pricing,
    shape: Footprint,
    among: Obstacles,
    bodies: Bodies,
    settings: Settings,
) -> int:
    """Drive to the most promising nodes, and branch from them.

    Args:
        nodes: the search.
        expansions: how many nodes to look at, at most.
        bound: cost above which nodes are of no use [kg m].
        table: lengths to go.
        branching: the arcs.
        pricing: of the path.
        shape: footprint with its margin.
        among: the walls.
        bodies: shapes for the sweep.
        settings: of the sweep.

    Returns:
        A node in the goal, -1 if there is more to do, -2 if the search is over.
    """
    scratch = make_scratch(bodies)
    corners = np.empty_like(shape.vertices)
    count = nodes.objects.shape[1]
    poses, objects, moved = np.empty((2, 3)), np.empty((count, 3)), np.empty(count)
    for _ in range(expansions):
        if nodes.counts[2] == 0:
            return -2
        node = _pop(nodes)
        if nodes.rows[node] < 0:
            nodes.counts[3] += 1
            if nodes.counts[1] == nodes.objects.shape[0]:
                return -2
            guess = nodes.estimates[node]
            length = _drive(
                nodes, node, pricing, shape, among, bodies,
                settings, scratch, corners, poses, objects, moved,
            )  # fmt: skip
            if length == 0.0 or not _settle(
                nodes, node, length, objects, moved, pricing, table, bodies
            ):
                continue
            if not nodes.costs[node] < bound:
                continue
            if nodes.estimates[node] > guess + 1e-9 * abs(guess):
                _push(nodes, node)  # dearer than it looked: others may come first
                continue
        elif nodes.parents[node] >= 0:
            if nodes.costs[node] > _best_there(nodes, node, table, bodies) + 1e-12:
                continue  # a cheaper node has taken its cell since
        if in_goal(nodes.poses[node, 0], nodes.poses[node, 1], pricing.goal):
            return node
        if nodes.counts[0] + branching.curvatures.shape[0] > nodes.poses.shape[0]:
            return -2
        _branch(nodes, node, bound, table, branching, pricing)
    return -1


@njit(cache=True, nogil=True)
def trace(nodes: Nodes, node: int) -> FloatArray:
    """The arcs (E, 2) from the root to a node."""
    count = 0
    at = node
    while nodes.parents[at] >= 0:
        count += 1
        at = nodes.parents[at]
    arcs = np.empty((count, 2))
    at = node
    for i in range(count - 1, -1, -1):
        arcs[i] = nodes.arcs[at]
        at = nodes.parents[at]
    return arcs
