"""Action modes of many control steps: drive along a heading, or to a point."""

from __future__ import annotations

from typing import ClassVar, NoReturn

import numpy as np

from pushplan.control import LegFollower, Legs, clamp_twist
from pushplan.envs.action_modes import ActionMode, Motion
from pushplan.envs.tasks.base import Task
from pushplan.geometry import VisibilityGraph
from pushplan.world import InvalidInputError, RobotModel, Twist, World
from pushplan.world.checks import FloatArray
from pushplan.world.outline import transform

_ESCAPES = 2  # number of times that one action makes room for a turn


def _motion(robot: RobotModel, points: FloatArray, period: float) -> Motion:
    follower = LegFollower(robot, Legs.ahead(points), response=period, escapes=_ESCAPES)

    def next_command(pose: FloatArray, time: float, held: bool) -> tuple[Twist, float] | None:
        command = follower.command(pose, time, period, stopped=held)
        steps = max(1, int(follower.steady / period + 1e-9))
        return None if command is None else (command, steps)

    return next_command


class _DriveAction(ActionMode):
    """A mode that drives to a point, and takes no velocities."""

    name: ClassVar[str]
    takes_velocities = False

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self._step = task.heading_step
        self._half = 0.5 * task.waypoint_window
        self._period = task.control_step

    def afterwards(self, command: Twist) -> Twist:
        """It stands."""
        return clamp_twist(self.robot, 0.0, 0.0)

    def _from_twist(self, twist: Twist) -> NoReturn:
        raise InvalidInputError(
            f"action mode {self.name!r} takes no velocities, got {twist!r}: make the environment "
            "with action='velocity', or give the policy the attribute actions = ('velocity',)"
        )


class HeadingAction(_DriveAction):
    """Turn to a heading and drive a fixed distance along it.

    One element: the heading relative to the robot's in units of pi, 0 straight ahead, positive to
    the left. The distance is the task's ``heading_step`` [m]. It ends early where the robot is
    stopped.
    """

    name = "heading"
    size = 1

    def start(self, action: FloatArray, world: World) -> Motion:
        """Drive straight to the point at that heading and distance."""
        heading = float(action[0]) * np.pi
        target = self._step * np.array([[np.cos(heading), np.sin(heading)]])
        return _motion(self.robot, transform(world.robot_pose, target), self._period)


class WaypointAction(_DriveAction):
    """Drive to a point by the shortest way around what is static.

    Two elements: the point in the robot's frame, x ahead and y to the left, in units of half the
    side of the task's ``waypoint_window`` [m]. The way keeps the robot's circumscribed disc clear
    of static things where there is such a way, else its inscribed disc; a point that cannot be
    reached is driven at straight. It ends early where the robot is stopped.
    """

    name = "waypoint"
    size = 2

    def start(self, action: FloatArray, world: World) -> Motion:
        """Drive the shortest way there."""
        target = transform(world.robot_pose, self._half * action[None, :])[0]
        low = world.static.bounds[:2]
        high = world.static.bounds[2:]
        points = self._way(world, np.clip(target, low, high))
        return _motion(self.robot, points, self._period)

    def _way(self, world: World, target: FloatArray) -> FloatArray:
        start = world.robot_pose[:2]
        for clearance in (self.robot.circumscribed_radius, self.robot.inscribed_radius):
            path = VisibilityGraph(world.static, clearance=clearance).shortest_path(start, target)
            if len(path.points) > 1:
                return path.points[1:]
        return target[None]
