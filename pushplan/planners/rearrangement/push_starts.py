"""`PushStarts`: poses of the robot behind, beside and around the objects that it is to push."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pushplan.core import geometry, motion
from pushplan.core import rearrangement as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.world import Movables, RobotModel, StaticMap
from pushplan.world.checks import FloatArray
from pushplan.world.outline import transform

_STARTS = 300  # free poses around an object at most
_DRAWS = 10  # poses that are looked at for each of them
_IN_OBJECT = 0.3
_RING = (0.2, 1.1)
"""They lie in a ring round the object, beyond that many of its radii: begin and width of the ring
[circumscribed radii]."""
_SPREAD = np.array([0.8191725134, 0.6710436067, 0.5497004779])
"""Steps of an additive recurrence that fills a cube evenly (Roberts 2018)."""


def heading_axes(heading: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) along a heading [rad] and to the left of it."""
    c = math.cos(heading)
    s = math.sin(heading)
    return np.array([c, s]), np.array([-s, c])


def initial_heading(path: FloatArray, ahead: float) -> float:
    """Heading [rad] from the start of a path to a point some distance along it [m]."""
    x, y, _, _ = core.along_path(path[0, 0], path[0, 1], path, 0.0, ahead)
    return math.atan2(y - path[0, 1], x - path[0, 0])


@dataclass(frozen=True, eq=False)
class PushStarts:
    """Poses from which a robot can push objects among what is static.

    Args:
        robot: that pushes.
        static: walls and columns.
        movables: the objects.
        poses: (K, 3) where they are.
        reach: distance of the robot's origin from the outline of an object in front of it [m].
        margin: distance that the robot keeps from what is static [m].
    """

    robot: RobotModel
    static: StaticMap
    movables: Movables
    poses: FloatArray
    reach: float
    margin: float

    def behind(self, k: int, heading: float, shift: float) -> FloatArray:
        """(3,) a pose behind object ``k`` from which to push it along a heading.

        Args:
            k: index of the object.
            heading: [rad].
            shift: how far the robot's middle is to the left of the object [m].
        """
        outline = self.movables.outline(k)
        return core.pose_behind(self.poses[k], outline, heading, shift, self.reach)

    def around(self, k: int) -> Iterator[FloatArray]:
        """Poses (3,) around object ``k`` that touch nothing, evenly spread."""
        x, y, _ = self.poses[k]
        radius = float(self.movables.radii[k])
        fraction = np.mod(0.5 + np.outer(np.arange(1, _DRAWS * _STARTS + 1), _SPREAD), 1.0)
        ring = _RING[0] + _RING[1] * fraction[:, 0]
        away = _IN_OBJECT * radius + self.robot.circumscribed_radius * ring
        bearing = 2.0 * np.pi * fraction[:, 1]
        heading = 2.0 * np.pi * fraction[:, 2] - np.pi
        poses = np.column_stack([x + away * np.cos(bearing), y + away * np.sin(bearing), heading])
        free = (pose for pose in poses if self.fits(pose) and self.is_clear(pose))
        return itertools.islice(free, _STARTS)

    @cached_property
    def _walls(self) -> motion.CollisionChecker:
        shape = footprint(self.robot, self.margin)
        return motion.CollisionChecker(shape, obstacles(self.static))

    def fits(self, pose: FloatArray) -> bool:
        """Return True if the robot fits at a pose (3,) among static obstacles."""
        return self._walls.is_free(pose)

    def is_clear(self, pose: FloatArray) -> bool:
        """Return True if the robot at a pose (3,) overlaps no object."""
        movables = self.movables
        away = np.hypot(*(self.poses[:, :2] - pose[:2]).T)
        for k in np.flatnonzero(away < self.robot.circumscribed_radius + movables.radii).tolist():
            outlines = [np.ascontiguousarray(part) for part in movables.parts_world(k)]
            for part in self.robot.contact_parts:
                body = np.ascontiguousarray(transform(pose, part))
                if any(geometry.convex_penetration(body, o)[0] > 0.0 for o in outlines):
                    return False
        return True
