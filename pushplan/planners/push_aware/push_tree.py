"""The nodes of a search tree whose arcs are driven with the objects carried along; compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.motion.arc_rollout import ArcMemory, roll_arc
from pushplan.motion.goal_region import in_goal
from pushplan.motion.path_problem import PathProblem
from pushplan.world.checks import FloatArray, IntArray


class PushTree(NamedTuple):
    """A search tree, in memory that is made once for a call."""

    poses: FloatArray  # (N, 3)
    costs: FloatArray  # (N,) m₀ l₀ + w Σ mᵢ lᵢ so far [kg m]
    estimates: FloatArray  # (N,) the same for the whole path through the node
    parents: IntArray  # (N,) -1 at the root
    arcs: FloatArray  # (N, 2) length [m] and curvature [1/m] of the arc that leads to the node
    rows: IntArray
    """(N,) which row of ``objects`` holds; -1 while the arc to the node has not been driven"""
    objects: FloatArray  # (M, K, 3)
    best: FloatArray  # (rows, columns, headings, signatures) least cost of a node in each cell
    counts: IntArray  # (4,) nodes, rows of objects, whether memory was full, arcs driven


def make_push_tree(
    count: int,  # nodes at most
    objects: int,  # number of objects
    memory: float,  # for their poses [MiB]
    cells: tuple[int, int, int, int] = (1, 1, 1, 1),  # shape of ``best``
) -> PushTree:
    """Empty memory for a search."""
    rows = int(memory * 2**20 / (24 * max(objects, 1)))
    return PushTree(
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


@kernel
def plant(tree: PushTree, pose: FloatArray, objects: FloatArray, estimate: float) -> None:
    """Begin a search at ``pose`` (3,) with the objects at ``objects`` (K, 3)."""
    tree.best[:] = np.inf
    copy_into(tree.poses[0], pose)
    tree.costs[0] = 0.0
    tree.estimates[0] = estimate
    tree.parents[0] = -1
    tree.rows[0] = 0
    copy_into(tree.objects[0], objects)
    tree.counts[0] = 1
    tree.counts[1] = 1
    tree.counts[2] = 0
    tree.counts[3] = 0


@kernel
def drive(tree: PushTree, node: int, problem: PathProblem, memory: ArcMemory) -> float:
    """Drive the arc to a node; returns the length driven [m], as `roll_arc` does."""
    parent = tree.parents[node]
    objects = tree.objects[tree.rows[parent]]
    longest = float(tree.arcs[node, 0])
    curvature = float(tree.arcs[node, 1])
    length: float = roll_arc(problem, tree.poses[parent], objects, longest, curvature, memory)
    if length > 0.0 and in_goal(memory.end[0], memory.end[1], problem.goal):
        copy_into(tree.poses[node], memory.end)  # it may come in before the end of the arc
    return length


@kernel(allocates=True)
def trace(tree: PushTree, node: int) -> FloatArray:
    """The arcs (E, 2) from the root to a node."""
    count = 0
    at = node
    while tree.parents[at] >= 0:
        count += 1
        at = tree.parents[at]
    arcs = np.empty((count, 2))
    at = node
    for i in range(count - 1, -1, -1):
        copy_into(arcs[i], tree.arcs[at])
        at = tree.parents[at]
    return arcs
