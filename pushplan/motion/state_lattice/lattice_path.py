"""From the arcs that a lattice search found to the poses of a path."""

from __future__ import annotations

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import goal_numbers
from pushplan.motion.state_lattice.built_lattice import BuiltLattice
from pushplan.motion.state_lattice.lattice_config import SPACING, LatticeConfig
from pushplan.motion.swept_path import SweptPath
from pushplan.world import GoalLine, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths


def sample_arcs(
    start: FloatArray, arcs: FloatArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses along (E, 2) arcs from a pose on, and the (N,) curvatures [1/m] to each."""
    turn = float(np.abs(arcs[:, 0] * arcs[:, 1]).sum())
    capacity = int(arcs[:, 0].sum() / spacing + turn / 0.1) + 2 * len(arcs) + 8
    poses = np.empty((capacity, 3))
    curvatures = np.zeros(capacity)
    poses[0] = start
    count = 1 + core.sample_pieces(start, arcs, spacing, poses[1:], curvatures[1:])
    return poses[:count], curvatures[:count]


def lay_path(
    built: BuiltLattice, arcs: FloatArray, world: World, config: LatticeConfig
) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses along arcs from the robot, and the (N,) curvatures that lead to them [1/m].

    The path is cut off where it reaches the goal, or the goal row of a lattice that ends before.
    """
    size = world.robot.circumscribed_radius
    spacing = SPACING * size
    poses, curvatures = sample_arcs(world.robot_pose, arcs, spacing)
    goal = world.navigation_goal
    if isinstance(goal, GoalLine):
        point, normal = built.finish(world)
        inside = np.flatnonzero((poses[:, :2] - point) @ normal >= -1e-9 * size)
    else:
        numbers = goal_numbers(goal, config.inset * size)
        inside = np.flatnonzero([core.in_goal(x, y, numbers) for x, y in poses[:, :2]])
    end = int(inside[0]) + 1 if len(inside) else len(poses)
    poses = poses[:end].copy()
    curvatures = curvatures[:end].copy()
    if isinstance(goal, GoalLine) and len(inside) and end > 1:
        _cut_at_line(poses, float(curvatures[-1]), spacing, point, normal)
    return poses, curvatures


def _cut_at_line(
    poses: FloatArray, curvature: float, spacing: float, point: FloatArray, normal: FloatArray
) -> None:
    """Put the last pose where the arc from the one before crosses a line, by bisection."""
    before = poses[-2]
    out = poses[-1]
    low = 0.0
    high = spacing
    for _ in range(50):
        middle = 0.5 * (low + high)
        core.along_arc(before, middle, curvature, out)
        if float((out[:2] - point) @ normal) < 0.0:
            low = middle
        else:
            high = middle
    core.along_arc(before, high, curvature, out)


def bare_path(poses: FloatArray, curvatures: FloatArray) -> SweptPath:
    """A path about which nothing is predicted."""
    works = np.zeros(len(poses))
    return SweptPath(poses, curvatures, None, arc_lengths(poses), works)  # type: ignore[arg-type]
