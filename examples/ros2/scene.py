"""`Scene`: a map, objects and odometry that come in as messages, as a `World`."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np

from pushplan.perception import ObjectTracker
from pushplan.ros import pose_from, static_map_from, time_from
from pushplan.world import GoalDisc, InvalidInputError, Movables, RobotModel, StaticMap, World
from pushplan.world.checks import FloatArray, expect
from pushplan.world.outline import transform

_AHEAD = 0.5  # by which stamps of objects may be ahead of the clock [s]
_CUBE = 1  # type of a visualization_msgs/Marker whose outline is its scale


class NavigationError(Exception):
    """Why a goal cannot be served.

    Args:
        code: name of an error code of the action's result, such as ``TIMEOUT``, or ``CANCELED``.
        reason: in words.
    """

    def __init__(self, code: str, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class Scene:
    """The newest map, objects and pose of the robot. Its methods may be called by any thread.

    Args:
        robot: footprint, mass and limits.
        frame: that all messages have to be in.
        margin: distance that plans keep from what is static [m].
        tracker: keeps identity and shape of the objects.
    """

    def __init__(
        self,
        robot: RobotModel,
        *,
        frame: str = "map",
        margin: float = 0.0,
        tracker: ObjectTracker | None = None,
    ) -> None:
        self.robot, self.frame, self.margin = expect("robot", robot, RobotModel), frame, margin
        self._tracker = ObjectTracker() if tracker is None else tracker
        self._lock = threading.Lock()
        self._static: StaticMap | None = None
        self._movables = Movables.empty()
        self._objects_at = -math.inf
        self._robot: tuple[FloatArray, FloatArray, float] | None = None

    def take_map(self, message: Any) -> None:
        """Take a ``nav_msgs/OccupancyGrid``; the same map again changes nothing."""
        static = static_map_from(message, self.frame)
        if static != self._static:
            self._static = static

    def take_odometry(self, message: Any) -> None:
        """Take a ``nav_msgs/Odometry``: pose in the world frame, velocity in the body frame."""
        pose, twist = pose_from(message, self.frame), message.twist.twist
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y = float(twist.linear.x), float(twist.linear.y)
        velocity = np.array([c * x - s * y, s * x + c * y, float(twist.angular.z)])
        self._robot = pose, velocity, time_from(message)

    def take_objects(self, message: Any, now: float) -> None:
        """Take a ``visualization_msgs/MarkerArray``: all objects that are seen at one time.

        Args:
            message: a marker an object, by its ``id``: a cube, or the corners of an outline in
                order.
            now: when an array without markers was seen, and before which all others were [s].

        Raises:
            InvalidInputError: if it cannot be read, or was seen later than now.
        """
        outlines = [self._outline(marker) for marker in message.markers]
        stamp = max((time_from(marker) for marker in message.markers), default=now)
        ids = [int(marker.id) for marker in message.markers]
        if stamp > now + _AHEAD:
            raise InvalidInputError(
                f"objects must not be seen later than now, got {stamp - now:.3g} s later"
            )
        with self._lock:
            if now < self._objects_at:  # the clock has stepped back: the tracker begins anew
                self._tracker.reset()
            self._objects_at = now
            self._movables = self._tracker.update(outlines, stamp, ids)

    def _outline(self, marker: Any) -> FloatArray:
        if marker.type == _CUBE:
            box = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
            corners = 0.5 * box * [marker.scale.x, marker.scale.y]
        else:
            corners = np.reshape([[p.x, p.y] for p in marker.points], (-1, 2))
        return transform(pose_from(marker, self.frame), corners)

    def world(self, goal: GoalDisc) -> World:
        """Everything as it is known now.

        Raises:
            NavigationError: while there is no map, or no odometry.
        """
        static, robot = self._static, self._robot
        if static is None:
            raise NavigationError("UNKNOWN", "no map has come in yet")
        if robot is None:
            raise NavigationError("TF_ERROR", "no odometry has come in yet")
        pose, twist, time = robot
        return World(
            robot=self.robot,
            robot_pose=pose,
            robot_twist=twist,
            static=static,
            movables=self._movables,
            goal=goal,
            time=time,
            margin=self.margin,
        )
