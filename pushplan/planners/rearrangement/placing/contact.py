"""`Contact`: an object that lies on the bumper with one of its faces, one body with the robot."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry import gyration_squares
from pushplan.planners.pushing import Bumper, PushModel, PushParameters, faces_of
from pushplan.world import Movables, RobotModel
from pushplan.world.checks import FloatArray
from pushplan.world.outline import convex_outline, flatten, transform

_FRACTION = 0.7  # of the stable curvature that is used
_LEAST_FACE = 0.2  # shortest face that is pushed [half widths of the bumper]
MARGIN = 0.07  # that robot and object keep from other objects [circumscribed radii]
_BESIDE = 0.8  # offset of a contact beside the middle, of what keeps the face on the bumper
_STRAIGHT = 1e-3  # curvature below which a face does not hold [1/circumscribed radii]


class Body(core.Footprint):
    """Convex parts (N, 2) in one frame, grown by a margin [m], as something that can be copied."""

    def __init__(self, parts: Sequence[FloatArray], margin: float) -> None:
        super().__init__(core.OwnFootprint(*flatten(parts), margin))
        self._made_of = parts, margin

    def __reduce__(self) -> tuple[Any, ...]:
        return Body, self._made_of


@dataclass(frozen=True, eq=False)
class Contact:
    """An object that lies with a face on the bumper.

    While friction holds it there, robot and object are one body, which turns on a radius of the
    stable curvature at least (Lynch and Mason, "Stable pushing", IJRR 15(6), 1996).

    Args:
        model: of the push.
        radius: least turning radius of the two [m].
        object_pose: (3,) of the object in the robot's frame.
        body: robot and object, in the robot's frame.
        wide: the same, grown by what they keep from other objects.
    """

    model: PushModel
    radius: float
    object_pose: FloatArray
    body: Body
    wide: Body

    @cached_property
    def _robot_pose(self) -> FloatArray:
        """(3,) of the robot in the object's frame."""
        return inverse(self.object_pose)

    def robot_at(self, object_pose: FloatArray) -> FloatArray:
        """(3,) pose of the robot that has the object at a pose (3,) on its bumper."""
        return compose(object_pose, self._robot_pose)

    def object_at(self, robot_pose: FloatArray) -> FloatArray:
        """(3,) pose of the object on the bumper of a robot at a pose (3,)."""
        return compose(robot_pose, self.object_pose)


def contacts_of(
    robot: RobotModel, movables: Movables, k: int, friction: float, *, beside: bool = False
) -> tuple[Contact, ...]:
    """The contacts of object ``k`` that the robot can push at, one for each face of its hull.

    Args:
        robot: the robot.
        movables: the objects.
        k: index of one.
        friction: Coulomb coefficient between robot and object.
        beside: not with the middle of a face on the middle of the bumper, but to its left and right
            as far as all of the face is on it.
    """
    compound = len(movables.parts(k)) > 1 or movables.gyration_radii[k] > 0.0
    radius = 0.0
    if compound:
        radius = math.sqrt(gyration_squares(movables.select([k]))[0])
    return _contacts(
        robot, np.ascontiguousarray(movables.outline(k)).tobytes(), radius, friction, beside
    )


@functools.lru_cache(maxsize=256)
def _contacts(
    robot: RobotModel, corners: bytes, radius: float, friction: float, beside: bool
) -> tuple[Contact, ...]:
    outline = convex_outline("outline", np.frombuffer(corners).reshape(-1, 2))
    size = robot.circumscribed_radius
    half = Bumper.of(robot).half
    found = []
    for face in faces_of(outline)[0]:
        if face.high - face.low < _LEAST_FACE * half:
            continue
        model = PushModel(robot, outline, PushParameters(friction), face, radius or None)
        curvature = _FRACTION * model.stable_curvature()
        if curvature < _STRAIGHT / size:
            continue
        middle = -0.5 * (face.low + face.high)
        most = _BESIDE * max(0.0, half - 0.5 * (face.high - face.low))
        if beside and most < _LEAST_FACE * half:
            continue
        for offset in (most, -most) if beside else (0.0,):
            pose = np.array([model.reach, middle + offset, -face.normal])
            parts = [*robot.wall_parts, transform(pose, outline)]
            turning = max(1.0 / curvature + abs(offset), robot.min_turning_radius)
            bodies = Body(parts, 0.0), Body(parts, MARGIN * size)
            found.append(Contact(model, turning, pose, *bodies))
    return tuple(found)


def compose(frame: FloatArray, pose: FloatArray) -> FloatArray:
    """(3,) a pose given in a frame (3,), in that frame's own frame."""
    x, y, theta = frame.tolist()
    dx, dy, turn = pose.tolist()
    c = math.cos(theta)
    s = math.sin(theta)
    return np.array([x + c * dx - s * dy, y + s * dx + c * dy, theta + turn])


def inverse(pose: FloatArray) -> FloatArray:
    """(3,) the pose of the world in a frame (3,)."""
    x, y, theta = pose.tolist()
    c = math.cos(theta)
    s = math.sin(theta)
    return np.array([-(c * x + s * y), s * x - c * y, -theta])


def ahead_of(pose: FloatArray, length: float) -> FloatArray:
    """(3,) the pose so far ahead [m], behind if negative."""
    return compose(pose, np.array([length, 0.0, 0.0]))
