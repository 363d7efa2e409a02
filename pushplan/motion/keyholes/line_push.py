"""Stable line pushes: the robot gets behind a face of an object and drives straight ahead."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pushplan.world import World
from pushplan.world.checks import FloatArray

_NARROW = 0.3  # faces narrower than this are not pushed [circumscribed radii]
SPACING = 0.1
"""Distance between the poses of a push [circumscribed radii]."""
CONTACT = 5
"""Index of the pose of a push in which the robot touches the face."""


@dataclass(frozen=True)
class LinePush:
    """Where a push begins.

    Args:
        object_index: of the object that is pushed.
        start: (3,) pose of the robot, whose disc touches the face.
        lead: distance from there to the contact [m].
    """

    object_index: int
    start: FloatArray
    lead: float

    def path(self, length: float, size: float) -> FloatArray:
        """(N, 3) poses from the start to the contact, which has index `CONTACT`, and on.

        Args:
            length: of the push itself [m].
            size: circumscribed radius of the robot [m].
        """
        lead = np.linspace(0.0, self.lead, CONTACT + 1)
        on = self.lead + np.arange(1, round(length / (SPACING * size)) + 1) * SPACING * size
        return straight(self.start, np.concatenate([lead, on]))


def straight(pose: FloatArray, along: FloatArray) -> FloatArray:
    """(N, 3) poses ahead of one (3,), by some distances (N,) [m], negative for behind."""
    heading = np.array([np.cos(pose[2]), np.sin(pose[2])])
    places = pose[:2] + along[:, None] * heading
    return np.column_stack([places, np.full(len(along), pose[2])])


def line_pushes(
    world: World, k: int, pose: FloatArray, clearance: float, offsets: tuple[float, ...]
) -> Iterator[LinePush]:
    """The pushes of object ``k`` at a pose (3,): at each face, in its middle and beside it.

    Args:
        world: whose robot and objects they are.
        k: index of the object.
        pose: of the object.
        clearance: of the robot's middle from the face at the start [m].
        offsets: how far beside the middle, as fractions of half the face.
    """
    size = world.robot.circumscribed_radius
    front = float(world.robot.vertices[:, 0].max())
    c, s = np.cos(pose[2]), np.sin(pose[2])
    corners = world.movables.outline(k) @ np.array([[c, s], [-s, c]]) + pose[:2]
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = b - a
        length = float(np.hypot(*edge))
        if length < _NARROW * size:
            continue
        out = np.array([edge[1], -edge[0]]) / length
        heading = float(np.arctan2(-out[1], -out[0]))
        for beside in offsets:
            place = 0.5 * (a + b) + 0.5 * beside * edge + clearance * out
            yield LinePush(k, np.array([*place, heading]), clearance - front)
