"""Ways of the robot to the starts of pushes, and what they cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pushplan.planners.rearrangement import pose_search
from pushplan.planners.rearrangement.pose_grid import LENGTHS, MOVES, TURNS, near_poses
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.scene import Ground, Scene
from pushplan.world.checks import FloatArray, IntArray

_EVERYWHERE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Approach:
    """Cheapest ways of the robot from where it is to every pose of the lattice.

    Args:
        costs: (16 * rows * columns,) [m].
        before: the pose before each, -1 for none.
    """

    costs: FloatArray
    before: IntArray


def approach_from(scene: Scene, led: int = -1) -> Approach:
    """Cheapest ways from where the robot is.

    Args:
        scene: the scene.
        led: index of an object that is not to be moved on the way; -1 if none.
    """
    return ways_from(scene, scene.fine, scene.world.robot_pose, led=led)


def ways_from(
    scene: Scene,
    ground: Ground,
    pose: FloatArray,
    share: float = 1.0,
    without: IntArray | None = None,
    led: int = -1,
    targets: IntArray = _EVERYWHERE,
) -> Approach:
    """Cheapest ways on a lattice.

    Args:
        scene: the scene.
        ground: its lattice, and what objects cost there.
        pose: (3,) from where.
        share: of the price of objects.
        without: indices of objects that are gone by then.
        led: index of an object that is not to be moved on the way; -1 if none.
        targets: see `search_poses`.
    """
    for reach in (1.5, 4.0):
        starts, costs = near_poses(ground.floor, pose, reach)
        if len(starts):
            break
    best, before = pose_search.search_poses(
        starts,
        costs,
        ground.floor,
        *ground.contacts(share, without, led),
        MOVES,
        LENGTHS,
        TURNS,
        scene.config.turn_price * scene.size,
        pose_search.ARM * scene.size,
        targets,
    )
    return Approach(best, before)


def arrivals_at(ground: Ground, pushes: Sequence[Push]) -> pose_search.Arrivals:
    """Where the starts of pushes are reached from."""
    found = [arrival_poses(ground, push.start) for push in pushes]
    return pose_search.Arrivals(
        np.concatenate([nodes for nodes, _ in found] or [np.zeros(0, dtype=np.int64)]),
        np.concatenate([extra for _, extra in found] or [np.zeros(0)]),
        np.cumsum([len(nodes) for nodes, _ in found], dtype=np.int64),
    )


def arrival_poses(ground: Ground, start: FloatArray) -> tuple[IntArray, FloatArray]:
    """Lattice poses from which the start of a push is reached, and what the rest costs [m]."""
    floor = ground.floor
    u = np.array([np.cos(start[2]), np.sin(start[2]), 0.0])
    nodes, extra = near_poses(floor, start - 0.7 * floor.step * u, 1.3)
    if not len(nodes):
        nodes, extra = near_poses(floor, start, 2.0)
    return nodes, extra
