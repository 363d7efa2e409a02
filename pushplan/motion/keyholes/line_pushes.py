"""Straight pushes of an object at the middle of its faces, and beside it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pushplan.world import World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import transform

_NARROW = 0.3  # faces narrower than this are not pushed [circumscribed radii]
SPACING = 0.1
"""Distance between the poses of a push [circumscribed radii]."""
CONTACT = 5
"""Index of the pose of a push in which the robot touches the face."""


def straight_poses(pose: FloatArray, along: FloatArray) -> FloatArray:
    """(N, 3) poses ahead of one (3,), by distances ``along`` (N,) [m], negative for behind."""
    heading = np.array([np.cos(pose[2]), np.sin(pose[2])])
    places = pose[:2] + along[:, None] * heading
    return np.column_stack([places, np.full(len(along), pose[2])])


def line_pushes(
    world: World, k: int, pose: FloatArray, clearance: float, offsets: tuple[float, ...]
) -> Iterator[tuple[FloatArray, float]]:
    """The pushes of object ``k`` at a pose (3,): at each face, in its middle and beside it.

    Args:
        world: whose robot and objects they are.
        k: index of the object.
        pose: of the object.
        clearance: of the robot's middle from the face at the start [m].
        offsets: how far beside the middle, as fractions of half the face.

    Returns:
        Pose (3,) of the robot at the start, whose disc touches the face, and distance from there to
        the contact [m].
    """
    size = world.robot.circumscribed_radius
    front = float(world.robot.vertices[:, 0].max())
    corners = transform(pose, world.movables.outline(k))
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = b - a
        length = float(np.hypot(*edge))
        if length < _NARROW * size:
            continue
        out = np.array([edge[1], -edge[0]]) / length
        heading = float(np.arctan2(-out[1], -out[0]))
        for beside in offsets:
            place = 0.5 * (a + b) + 0.5 * beside * edge + clearance * out
            yield np.array([*place, heading]), clearance - front


def push_path(start: FloatArray, lead: float, longest: float, size: float) -> FloatArray:
    """(N, 3) poses of a push to the contact, which has index `CONTACT`, and on.

    Args:
        start: (3,) pose of the robot at the start.
        lead: distance to the contact [m].
        longest: distance from there on [m].
        size: circumscribed radius of the robot [m].
    """
    on = lead + np.arange(1, round(longest / (SPACING * size)) + 1) * SPACING * size
    return straight_poses(start, np.concatenate([np.linspace(0.0, lead, CONTACT + 1), on]))
