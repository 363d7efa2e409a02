"""Paths of the robot to the starts of pushes, and what they cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.planners.rearrangement.pose_grid_kernels import near_poses
from pushplan.planners.rearrangement.pose_search_kernels import (
    Arrivals,
    PoseSearchProblem,
    search_poses,
)
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_scene import ContactGrid, PushScene
from pushplan.world.checks import FloatArray, IntArray

_EVERYWHERE = np.zeros(0, dtype=np.int64)


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
    return search_approaches(scene, scene.fine, scene.world.robot_pose, target=target)


def search_approaches(
    scene: PushScene,
    contact_grid: ContactGrid,
    pose: FloatArray,
    fraction: float = 1.0,
    without: IntArray | None = None,
    target: int = -1,
    until: IntArray = _EVERYWHERE,
) -> ApproachTree:
    """Cheapest paths on a lattice.

    Args:
        scene: the scene.
        contact_grid: its lattice, and what objects cost there.
        pose: (3,) from where.
        fraction: of the cost of objects.
        without: indices of objects that are gone by then.
        target: index of an object that is not to be moved on the way; -1 if none.
        until: flat indices of poses after which to stop; none to go on to the end.
    """
    for reach in (1.5, 4.0):
        starts, costs = near_poses(contact_grid.grid, np.array(pose), reach)
        if len(starts):
            break
    problem = PoseSearchProblem(
        starts,
        costs,
        contact_grid.grid,
        *contact_grid.contacts(fraction, without, target),
        turn_cost=scene.turn_cost,
        arm=scene.arm,
        targets=until,
    )
    return ApproachTree(*search_poses(problem), target)


def arrivals_at(contact_grid: ContactGrid, pushes: Sequence[Push]) -> Arrivals:
    """The poses from which the starts of pushes are reached."""
    found = [arrival_poses(contact_grid, push.start) for push in pushes]
    return Arrivals(
        np.concatenate([nodes for nodes, _ in found] or [np.zeros(0, dtype=np.int64)]),
        np.concatenate([extra for _, extra in found] or [np.zeros(0)]),
        np.cumsum([len(nodes) for nodes, _ in found], dtype=np.int64),
    )


def arrival_poses(contact_grid: ContactGrid, start: FloatArray) -> tuple[IntArray, FloatArray]:
    """Lattice poses from which the start of a push is reached, and the cost of the rest [m]."""
    grid = contact_grid.grid
    u = np.array([np.cos(start[2]), np.sin(start[2]), 0.0])
    nodes, extra = near_poses(grid, start - 0.7 * grid.step * u, 1.3)
    if not len(nodes):
        nodes, extra = near_poses(grid, start, 2.0)
    return nodes, extra
