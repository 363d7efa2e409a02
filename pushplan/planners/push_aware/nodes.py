"""The nodes of a search tree whose arcs are driven with the objects carried along; compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction.kernels import Bodies, Scratch, Settings, advance
from pushplan.motion.collision import Footprint, Obstacles, is_free
from pushplan.motion.dubins import along_arc, step_along
from pushplan.motion.shortcutting import Pricing, in_goal
from pushplan.world.checks import FloatArray, IntArray


class Nodes(NamedTuple):
    """A search tree, in memory that is made once for a call."""

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
    best: FloatArray
    """(rows, columns, headings, signatures) least cost of a node in each cell"""
    counts: IntArray
    """(4,) nodes, rows of objects, whether memory was full, arcs driven"""


def make_nodes(
    count: int, objects: int, memory: float, cells: tuple[int, int, int, int] = (1, 1, 1, 1)
) -> Nodes:
    """Empty memory for a search.

    Args:
        count: nodes at most.
        objects: number of objects.
        memory: for their poses [MiB].
        cells: shape of ``best``.
    """
    rows = int(memory * 2**20 / (24 * max(objects, 1)))
    return Nodes(
        poses=np.empty((count, 3)),
        costs=np.empty(count),
        estimates=np.empty(count),
        parents=np.empty(count, np.int64),
        arcs=np.empty((count, 2)),
        rows=np.empty(count, np.int64),
        objects=np.empty((max(2, min(rows, count)), objects, 3)),
        best=np.empty(cells),
        counts=np.zeros(4, np.int64),
    )


@kernel(allocates=True)
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


@kernel(allocates=True)
def drive(
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


@kernel(allocates=True)
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
