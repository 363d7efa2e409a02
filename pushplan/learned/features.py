"""`FeatureObservation`: distances and directions around the robot, as a short vector."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from pushplan.core import geometry
from pushplan.core import perception as core
from pushplan.geometry import goal_distances
from pushplan.observation.builder import LimitedVector
from pushplan.observation.state import goal_point
from pushplan.world import Goal, GoalDisc, GoalLine, ObjectGoals, StaticMap, World
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveFloat
from pushplan.world.checks import FloatArray, IntArray, expect, frozen
from pushplan.world.outline import flatten

_GUIDE = 10
_EACH = 9
_PLACE = 6
_EQUAL = 4
"""Headings of an object without a place that count as one, as of a square."""


@dataclass(frozen=True)
class FeatureObservation(LimitedVector, CheckedFields):
    """Features for pushing, in the robot's frame, cheap to compute and to learn from.

    Our own variant beside the images of the Bench-Push paper. All lengths are divided by
    ``range``. In this order:

    - 10 numbers that guide: cosine and sine of the robot's heading; the next and the second next
      bend of the shortest way around what is static (x, y each; for goals of objects both are
      the middle of the goal); the length of that way; the vector to the nearest of the bounds,
      outwards (x, y); and 1 if the way is one for the robot, else 0. The way keeps the robot's
      inscribed disc clear of static things where there is such a way.
    - ``rays`` numbers, from 0 (nothing within the range) to 1 (touching), for rays around the
      robot's origin, the first straight ahead, then counter-clockwise: what is static or a bound.
    - ``rays`` numbers for what may be pushed.
    - 9 numbers for each of the ``objects`` nearest objects, those that still have to be moved
      first: x, y; cosine and sine of four times its heading, which is the same for a square
      however it is turned; radius; unit vector along its own shortest way to the goal, and the
      length of the way (0 where the goal is one for the robot); 1 as a sign that it is there.
      Where the headings that count as one at its place are not four, it is that many times.
    - with ``places``, 6 more numbers for each of these objects, in its own frame: x, y of the
      robot; x, y of its place, cosine and sine of the least turn to it (0 without a place).

    Args:
        rays: how many rays, 0 for none.
        objects: how many objects.
        range: how far it sees, and the unit of lengths [m].
        limit: values are clipped to it.
        places: say more about objects that have places of their own.
    """

    rays: Annotated[int, Limits(0, 4096)] = 24
    objects: Annotated[int, Limits(0, 4096)] = 5
    range: PositiveFloat = 6.0
    limit: PositiveFloat = 5.0
    places: bool = False

    @property
    def _each(self) -> int:
        return _EACH + _PLACE * self.places

    @property
    def shape(self) -> tuple[int]:
        """Length of the vector."""
        return (_GUIDE + 2 * self.rays + self._each * self.objects,)

    def observe(self, world: World) -> NDArray[np.float32]:
        """The vector."""
        x, y, theta = world.robot_pose.tolist()
        c = math.cos(theta)
        s = math.sin(theta)
        to_body = np.array([[c, -s], [s, c]]) / self.range  # row vectors times this
        out = np.zeros(self.shape)
        out[:2] = c, s
        self._guide(out[2:_GUIDE], world, to_body)
        if self.rays:
            objects = world.movables
            corners = np.empty_like(objects.part_vertices)
            poses = objects.poses[objects.part_owners]
            geometry.transform_outlines(poses, objects.part_vertices, objects.part_offsets, corners)
            rays = out[_GUIDE : _GUIDE + 2 * self.rays].reshape(2, self.rays)
            for row, outlines in zip(
                rays, (_walls(world.static), (frozen(corners), objects.part_offsets)), strict=True
            ):
                lengths = np.full(self.rays, self.range)
                core.cast_rays(lengths, x, y, theta, *outlines)
                row[:] = 1.0 - lengths / self.range
        if self.objects and len(world.movables):
            self._nearest(out[_GUIDE + 2 * self.rays :].reshape(-1, self._each), world, to_body)
        return np.clip(out, -self.limit, self.limit).astype(np.float32)

    def _guide(self, out: FloatArray, world: World, to_body: FloatArray) -> None:
        """The numbers after cosine and sine."""
        at = world.robot_pose[:2]
        goal = world.goal
        if isinstance(goal, GoalDisc | GoalLine):
            ahead, length = _way(world.static, world.place_goal, world.robot.inscribed_radius, at)
            out[:4] = ((ahead - at) @ to_body).ravel()
            out[4] = length / self.range
            out[7] = 1.0
        else:
            out[:4] = np.tile((goal_point(world) - at) @ to_body, 2)
        x0, y0, x1, y1 = world.static.bounds.tolist()
        gaps = (at[0] - x0, at[1] - y0, x1 - at[0], y1 - at[1])
        nearest = int(np.argmin(gaps))
        outward = ((-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0))[nearest]
        out[5:7] = (np.array(outward) * gaps[nearest]) @ to_body

    def _nearest(self, rows: FloatArray, world: World, to_body: FloatArray) -> None:
        poses = world.movables.poses
        radii = world.movables.radii
        goal = world.goal
        offset = poses[:, :2] - world.robot_pose[:2]
        away = np.hypot(offset[:, 0], offset[:, 1])
        at = np.full(len(poses), -1)
        equal = np.full(len(poses), _EQUAL)
        if isinstance(goal, ObjectGoals):
            at = goal.assigned(world.movables.ids, poses)
            equal[at >= 0] = goal.symmetries[at[at >= 0]]
        if isinstance(goal, GoalDisc | GoalLine):
            chosen = np.argsort(away, kind="stable")[: self.objects]
        else:
            ways = [_way_of_object(world, *one) for one in zip(poses, at.tolist(), strict=True)]
            waiting = np.array([length > 0.0 for _, length in ways])
            if isinstance(goal, ObjectGoals):
                waiting &= ~world.completed
            chosen = np.lexsort((away, ~waiting))[: self.objects]
            for row, k in enumerate(chosen.tolist()):
                direction, length = ways[k]
                rows[row, 5:7] = direction @ to_body * self.range
                rows[row, 7] = length / self.range
        rows = rows[: len(chosen)]
        turn = equal[chosen] * (poses[chosen, 2] - world.robot_pose[2])
        rows[:, :2] = offset[chosen] @ to_body
        rows[:, 2] = np.cos(turn)
        rows[:, 3] = np.sin(turn)
        rows[:, 4] = radii[chosen] / self.range
        rows[:, 8] = 1.0
        for row, k in enumerate(chosen.tolist() if self.places else ()):
            rows[row, _EACH:] = self._place(world, poses[k], int(at[k]))

    def _place(self, world: World, pose: FloatArray, at: int) -> FloatArray:
        """(6,) the robot, and the place of an object, in its frame."""
        out = np.zeros(_PLACE)
        heading = float(pose[2])
        if at >= 0:
            goal = expect("goal", world.goal, ObjectGoals)
            x, y, wanted = goal.poses[at].tolist()
            turn = math.remainder(wanted - heading, math.tau / int(goal.symmetries[at]))
            heading = wanted - turn  # of those that count as one, which no robot can tell apart
            out[2:4] = x - pose[0], y - pose[1]
            out[4:] = math.cos(turn), math.sin(turn)
        out[:2] = world.robot_pose[:2] - pose[:2]
        c = math.cos(heading)
        s = math.sin(heading)
        out[:4] = (out[:4].reshape(2, 2) @ np.array([[c, -s], [s, c]]) / self.range).ravel()
        return out


@functools.lru_cache(maxsize=16)
def _walls(static: StaticMap) -> tuple[FloatArray, IntArray]:
    """Outlines of what is static, and the bounds as one more."""
    x0, y0, x1, y1 = static.bounds.tolist()
    frame = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    return flatten([*static.convex_parts, frame])


def _way(
    static: StaticMap, goal: Goal, clearance: float, at: FloatArray
) -> tuple[FloatArray, float]:
    """(2, 2) the next two points of the way to a goal [m], and its length [m]."""
    for margin in (clearance, 0.0):
        path = goal_distances(static, goal, clearance=margin).path_from(at)
        if math.isfinite(path.length) and len(path.points) > 1:
            return path.points[[1, min(2, len(path.points) - 1)]], path.length
        if path.length == 0.0:
            break
    return np.stack([at, at]), 0.0


def _way_of_object(world: World, pose: FloatArray, at: int) -> tuple[FloatArray, float]:
    """(2,) unit vector along the way of an object [m], and its length [m]; 0 where there is none.

    Args:
        world: with a goal for objects.
        pose: (3,) of the object.
        at: number of its place, -1 for none, where objects have places.
    """
    goal = world.manipulation_goal
    if isinstance(goal, ObjectGoals):
        if at < 0:
            return np.zeros(2), 0.0
        distances = goal_distances(world.static, goal.places[at], to_center=True)
    else:
        distances = goal_distances(world.static, goal)
    path = distances.path_from(pose[:2])
    if not math.isfinite(path.length) or len(path.points) < 2:
        return np.zeros(2), 0.0
    leg = path.points[1] - path.points[0]
    size = float(np.hypot(*leg))
    return (leg / size if size > 0.0 else leg), path.length
