"""`StateObservation`: the scene as a short vector."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pushplan.observation.builder import LimitedVector
from pushplan.world import GoalDisc, GoalLine, ObjectGoals, World
from pushplan.world.checked_fields import CheckedFields, NonNegativeInt, PositiveFloat
from pushplan.world.checks import FloatArray, expect
from pushplan.world.outline import centroid

_OWN = 6
_EACH = 5


@dataclass(frozen=True)
class StateObservation(LimitedVector, CheckedFields):
    """Low-dimensional observation of fixed length.

    Robot x, y [m], cos and sin of its heading; x, y [m] of the goal in the robot's frame; then for
    each object x, y [m], cos and sin of its heading in the robot's frame, and 1 as a sign that it
    is there. The rows are in the order of the ids: an object has the row of its id, so that it
    keeps it while others leave the floor, unless an id is no row; then the objects follow each
    other, and of too many the nearest are kept. Rows of absent objects are zero. A goal disc is
    given by its centre, a line by its nearest point, a receptacle or clearance area by its middle,
    places of objects by the mean of all.

    Args:
        max_objects: rows for objects.
        limit: lengths are clipped to this [m].
        places: each row goes on with x, y [m], cos and sin of the heading of the object's place in
            the robot's frame, and 1 as a sign that it has one. Of headings that count as the same
            it is the nearest to the object's. Only where objects have places.
    """

    max_objects: NonNegativeInt = 20
    limit: PositiveFloat = 1000.0
    places: bool = False

    @property
    def shape(self) -> tuple[int]:
        """Length of the vector."""
        return (_OWN + _EACH * (1 + self.places) * self.max_objects,)

    def observe(self, world: World) -> NDArray[np.float32]:
        """The vector."""
        x, y, theta = expect("world", world, World).robot_pose
        c = np.cos(theta)
        s = np.sin(theta)
        to_body = np.array([[c, -s], [s, c]])  # row vectors times this turn into the body frame
        objects = world.movables.poses
        relative = (objects[:, :2] - world.robot_pose[:2]) @ to_body
        columns = np.column_stack(
            [_directed(relative, objects[:, 2] - theta), np.ones(len(objects))]
        )
        if self.places:
            columns = np.hstack([columns, _places(world, to_body)])
        rows = world.movables.ids
        if len(rows) and not 0 <= rows.min() <= rows.max() < self.max_objects:
            nearest = np.argsort(np.hypot(relative[:, 0], relative[:, 1]), kind="stable")
            keep = np.sort(nearest[: self.max_objects])
            columns = columns[keep]
            rows = np.arange(len(keep))
        out = np.zeros(self.shape)
        out[:4] = x, y, c, s
        out[4:6] = (goal_point(world) - world.robot_pose[:2]) @ to_body
        out[_OWN:].reshape(-1, _EACH * (1 + self.places))[rows] = columns
        return np.clip(out, self.low, self.high).astype(np.float32)


def _directed(points: FloatArray, turns: FloatArray) -> FloatArray:
    """(N, 4) points with cos and sin of angles."""
    return np.column_stack([points, np.cos(turns), np.sin(turns)])


def _places(world: World, to_body: FloatArray) -> FloatArray:
    """(N, 5) columns of the places of the objects; zero for those without one."""
    goal = expect("goal", world.goal, ObjectGoals)
    objects = world.movables
    numbers = goal.assigned(objects.ids, objects.poses)
    has = numbers >= 0
    out = np.zeros((len(objects), _EACH))
    poses = goal.poses[numbers[has]]
    equal = math.tau / goal.symmetries[numbers[has]]
    off = poses[:, 2] - objects.poses[has, 2]
    headings = poses[:, 2] - equal * np.round(off / equal)
    points = (poses[:, :2] - world.robot_pose[:2]) @ to_body
    out[has] = np.column_stack(
        [_directed(points, headings - world.robot_pose[2]), np.ones(has.sum())]
    )
    return out


def goal_point(world: World) -> FloatArray:
    """The place (2,) [m] that stands for the goal of a world in observations."""
    goal = world.goal
    if isinstance(goal, GoalDisc):
        return goal.center
    at = world.robot_pose[:2]
    if isinstance(goal, GoalLine):
        nearest: FloatArray = at + np.dot(goal.point - at, goal.normal) * goal.normal
        return nearest
    if isinstance(goal, ObjectGoals):
        middle: FloatArray = goal.poses[:, :2].mean(axis=0)
        return middle
    return centroid(goal.polygon)
