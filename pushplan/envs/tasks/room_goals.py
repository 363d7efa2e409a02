"""What the goal of a world file makes of a room: distances, what is done, and the scoring."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from pushplan.envs.tasks.base import StepOutcome
from pushplan.envs.tasks.layout import those_inside
from pushplan.geometry.distance_field import GeodesicField
from pushplan.world import Receptacle, ScenarioError, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray
from pushplan.world.outline import grown_outline

WALL_REWARD = -50.0
OUTSIDE_REWARD = -50.0
SUCCESS_REWARD = 200.0
DONE_REWARD = 10.0
PROGRESS_REWARD = 150.0
_LEAN = 0.02
"""How far a corner may be outside a receptacle, as a fraction of the object's radius: an object
that leans on a wall overlaps it a little."""


class RobotGoal:
    """The robot drives to a disc or over a line.

    Reward: 150 times the decrease of the goal distance, minus 150 times the work on the objects
    over the robot's mass, both as fractions of the way from the file's start; -50 at a wall or
    beyond the bounds of the map, +200 at the goal.
    """

    kind: Literal["robot"] = "robot"

    def __init__(self, world: World, field: GeodesicField) -> None:
        self._goal, self._field = world.navigation_goal, field
        self._mass, self._bounds = world.robot.mass, world.static.bounds
        x, y, _ = world.robot_pose.tolist()
        self.way = field.exact(x, y)
        self.is_done = self.way == 0.0

    def score(self, before: World, after: World, work: float, touched_static: bool) -> StepOutcome:
        """A wall is a failure even where the goal is reached at once."""
        near, far = (self._field.sample(*world.robot_pose[:2]) for world in (after, before))
        reward = PROGRESS_REWARD * (far - near - work / self._mass) / self.way
        if touched_static:
            return StepOutcome(reward + WALL_REWARD, False, "wall", True, False)
        at = after.robot_pose[:2]
        if (at < self._bounds[:2]).any() or (at > self._bounds[2:]).any():
            return StepOutcome(reward + OUTSIDE_REWARD, False, "left_map", True, False)
        if self.is_there(after.robot_pose):
            return StepOutcome(reward + SUCCESS_REWARD, True, "goal", True, False)
        return StepOutcome(reward, False, "", False, False)

    def is_there(self, pose: FloatArray) -> bool:
        """Whether a robot at this pose (3,) is at the goal."""
        return self._goal.distance(float(pose[0]), float(pose[1])) == 0.0


class ObjectsGoal:
    """Every object goes into a receptacle, where it leaves the floor, or off an area.

    Reward: 150 times the decrease of the objects' goal distances, as a fraction of those at the
    file's start; +10 for each object that is done and -10 for each that is no longer, +200 when
    all are.
    """

    kind: Literal["objects"] = "objects"

    def __init__(self, world: World, field: GeodesicField) -> None:
        if not len(world.movables):
            raise ScenarioError("room: a goal for objects needs an object, the world has none")
        self._field, self._world = field, world
        self._far = float(field.values[np.isfinite(field.values)].max(initial=0.0))
        # 1 m where all centres are there already, but not all corners
        self.way = float(self._distances(world.movables.poses).sum()) or 1.0
        starts = world.movables.poses[:, :2].tolist()
        if not any(np.isfinite(field.exact(x, y)) for x, y in starts):
            self.way = math.inf
        self.is_done = bool(world.completed.all())
        self._mouth: Receptacle | None = None
        if isinstance(world.goal, Receptacle):
            lean = _LEAN * float(world.movables.radii.min())
            self._mouth = Receptacle(grown_outline(world.goal.polygon, lean))

    def _distances(self, poses: FloatArray) -> FloatArray:
        ways = [min(self._field.sample(x, y), self._far) for x, y in poses[:, :2].tolist()]
        return np.array(ways)

    def leaving(self, ids: IntArray, poses: FloatArray) -> IntArray:
        """Ids of the objects that are in the receptacle now."""
        assert self._mouth is not None
        return those_inside(self._mouth, self._world.movables, ids, poses)

    def _state(self, world: World) -> tuple[float, BoolArray]:
        """Summed goal distance of all objects of the start [m], and which are done."""
        objects = world.movables
        done = ~np.isin(self._world.movables.ids, objects.ids)
        ways = self._distances(objects.poses)
        if self._mouth is None:
            done[~done] = world.completed
        return float(ways.sum()), done

    def score(self, before: World, after: World, work: float, touched_static: bool) -> StepOutcome:
        """Walls do not end it."""
        (far, was_done), (near, done) = self._state(before), self._state(after)
        gained = int(done.sum()) - int(was_done.sum())
        reward = PROGRESS_REWARD * (far - near) / self.way + DONE_REWARD * gained
        if done.all():
            return StepOutcome(reward + SUCCESS_REWARD, True, "done", True, False, done)
        return StepOutcome(reward, False, "", False, False, done)
