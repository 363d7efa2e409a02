"""The front of a robot and the face of a box, from their outlines."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from pushplan.world import InvalidInputError, RobotModel
from pushplan.world.checked_fields import CheckedFields, PositiveFloat
from pushplan.world.checks import FloatArray, expect, number
from pushplan.world.outline import convex_outline

_SAMPLES = 401
_STEEP = 0.8  # |dx/dy| from which an edge is a flank and no longer part of the front
_FLAT = 0.02  # depth of a front, as a fraction of its half width, below which it counts as straight


@dataclass(frozen=True)
class Bumper(CheckedFields):
    """The front of a robot: x = front + curvature y² / 2 for |y| <= half, body frame [m].

    Args:
        front: distance of its middle from the axle [m].
        half: half its width [m].
        curvature: curvature [1/m]: 0 straight, positive where the ends reach ahead and hold a box,
            negative for a nose. A V-shaped front is replaced by the parabola nearest to it.
    """

    front: PositiveFloat
    half: PositiveFloat
    curvature: float

    field_prefix: ClassVar[str] = "bumper "

    @classmethod
    def of(cls, robot: RobotModel) -> Bumper:
        """The front of a robot's footprint."""
        return _bumper(expect("robot", robot, RobotModel))


@dataclass(frozen=True)
class Face(CheckedFields):
    """A side of a box.

    Args:
        normal: direction of its inward normal in the box's frame [rad].
        depth: a, its distance from the centroid [m].
        low: its right end seen along the inward normal, from the centroid [m], negative.
        high: its left end [m].
    """

    normal: float
    depth: PositiveFloat
    low: float
    high: float

    field_prefix: ClassVar[str] = "face "

    def __post_init__(self) -> None:
        super().__post_init__()
        number("face high", self.high, low=self.low, open_low=True)


def faces_of(outline: FloatArray) -> tuple[list[Face], FloatArray]:
    """The sides of a convex box, and what says which of them a push meets.

    Args:
        outline: (N, 2) convex, counter-clockwise corners, origin at the centroid [m].

    Returns:
        Faces, and (N, 3): the inward normal and an advantage for length. A push along a unit
        vector meets the face of the greatest product of normal and vector, plus advantage.
    """
    edges = np.roll(outline, -1, axis=0) - outline
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    inward = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / lengths[:, None]
    faces = []
    for normal, corner, edge in zip(inward, outline, edges, strict=True):
        along = np.array([-normal[1], normal[0]])
        ends = sorted((float(corner @ along), float((corner + edge) @ along)))
        depth = -float(corner @ normal)
        faces.append(Face(math.atan2(normal[1], normal[0]), depth, ends[0], ends[1]))
    # of sides that face it nearly alike the longer one
    return faces, np.column_stack([inward, 0.05 * lengths / lengths.max()])


def face_towards(outline: FloatArray, direction: float) -> Face:
    """The face of a box that a push along ``direction`` [rad, box frame] meets most squarely.

    Args:
        outline: (N, 2) convex, counter-clockwise corners, origin at the centroid [m].
        direction: [rad].
    """
    outline = convex_outline("outline", outline)
    direction = number("direction", direction)
    faces, scores = faces_of(outline)
    facing = scores @ np.array([math.cos(direction), math.sin(direction), 1.0])
    return faces[int(np.argmax(facing))]


@lru_cache(maxsize=64)
def _bumper(robot: RobotModel) -> Bumper:
    wide = float(np.abs(robot.vertices[:, 1]).max())
    ys = np.linspace(-wide, wide, _SAMPLES) * (1.0 - 1e-9)
    front = np.full(_SAMPLES, -np.inf)
    for part in robot.contact_parts:
        front = np.maximum(front, _foremost(part, ys))
    middle = _SAMPLES // 2
    if not math.isfinite(front[middle]) or front[middle] <= 0.0:
        raise InvalidInputError(f"robot {robot.name!r} has no front ahead of its axle to push with")
    steps = np.diff(front) / np.diff(ys)
    steep = ~(np.abs(steps) < _STEEP)
    left = np.flatnonzero(steep[middle:])
    right = np.flatnonzero(steep[:middle])
    last = middle + int(left[0]) if len(left) else _SAMPLES - 1
    first = int(right[-1]) + 1 if len(right) else 0
    half = float(min(ys[last], -ys[first]))
    if half <= 0.0:
        raise InvalidInputError(f"robot {robot.name!r} has a pointed front, which holds no box")
    inside = np.abs(ys) <= half
    square = 0.5 * ys[inside] ** 2
    curvature, ahead = np.polyfit(square, front[inside], 1)
    if abs(curvature) * 0.5 * half * half < _FLAT * half:
        return Bumper(float(front[inside].max()), half, 0.0)
    return Bumper(float(ahead), half, float(curvature))


def _foremost(part: FloatArray, ys: FloatArray) -> FloatArray:
    """Greatest x of a convex part at each y, -inf beside it."""
    found = np.full(len(ys), -np.inf)
    for (ax, ay), (bx, by) in zip(part, np.roll(part, -1, axis=0), strict=True):
        low = min(ay, by)
        high = max(ay, by)
        if high - low < 1e-12:
            continue
        at = (ys >= low) & (ys <= high)
        fraction = (ys[at] - ay) / (by - ay)
        found[at] = np.maximum(found[at], ax + fraction * (bx - ax))
    return found
