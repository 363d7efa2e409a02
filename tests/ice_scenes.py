"""Scenes of open water for tests."""

import numpy as np

from pushplan.world import GoalLine, Movables, RobotModel, StaticMap, World

HULL = np.array(
    [
        *((1.0, 0.0), (0.9, 0.1), (0.5, 0.25), (-1.0, 0.25)),
        *((-1.0, -0.25), (0.5, -0.25), (0.9, -0.1)),
    ]
)


def channel(floes, *, hull=HULL, scale=1.0, goal=9.0, static=None, pose=None) -> World:
    """A ship at the origin that looks along y; floes are (outline, pose)."""
    outlines = [outline for outline, _ in floes]
    poses = np.array([pose for _, pose in floes], dtype=float).reshape(-1, 3)
    return World(
        robot=RobotModel.from_outline(
            scale * hull,
            mass=1.0,
            drive="constant_speed",
            max_speed=0.3 * scale,
            max_turn_rate=0.224,
        ),
        robot_pose=[0.0, 0.0, np.pi / 2] if pose is None else pose,
        static=static or StaticMap.build(bounds=np.array([-6.0, -1.0, 6.0, 39.0]) * scale),
        movables=Movables.from_outlines(outlines, poses),
        goal=GoalLine([0.0, goal * scale], [0.0, 1.0]),
    )


def straight_path(start: float, end: float, step: float = 0.1) -> np.ndarray:
    """(N, 3) poses along y."""
    y = np.arange(start, end + 1e-9, step)
    return np.column_stack([np.zeros_like(y), y, np.full_like(y, np.pi / 2)])
